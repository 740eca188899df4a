/* Levels that are modelled by hand: they have the points that they were given, others follow, and where the
 * cage moves, what is modelled moves with it. */
#include "tweend/detail.h"

#include <math.h>
#include <string.h>

#include "cube.h"
#include "refined_mesh.h"
#include "torus_cage.h"

static float *moved_points(const level *at, uint32_t step) {
  uint32_t count = 3 * at->mesh.point_count;
  float *points = malloc(count * sizeof *points);
  assert_non_null(points);
  for (uint32_t i = 0; i < count; i++)
    points[i] = at->points[i] + (i / 3 % step == 0 ? 0.02f * (float)(i * i % 11) : 0);
  return points;
}

static tw_mesh sculpt(const tw_mesh *mesh, tw_surface_options options, const float *points, tw_arena *arena) {
  tw_mesh out;
  tw_error error;
  if (tw_mesh_sculpt(mesh, &options, points, NULL, NULL, arena, &out, &error) != TW_OK)
    fail_msg("level %u: %s %s", options.level, error.pointer, error.detail);
  assert_int_equal(tw_mesh_check_details(&out, &error), TW_OK);
  return out;
}

static void has_points(const tw_mesh *mesh, tw_surface_options options, const float *points, float most) {
  level now = refine(mesh, options);
  float difference = greatest_difference(now.points, points, 3 * (size_t)now.mesh.point_count);
  if (!(difference <= most)) fail_msg("level %u is missed by %g", options.level, (double)difference);
  free_level(&now);
}

/* Level after level, so that each has others above and below it. */
static void takes_points(const tw_mesh *cage, tw_scheme scheme, const uint32_t *depths, uint32_t count) {
  tw_arena *arena = tw_arena_create();
  tw_mesh mesh = *cage;
  for (uint32_t i = 0; i < count; i++) {
    tw_surface_options options = options_of(scheme, depths[i]);
    options.normals = true;
    level before = refine(&mesh, options);
    float *points = moved_points(&before, 3);
    tw_mesh next = sculpt(&mesh, options, points, arena);
    has_points(&next, options, points, 2e-6f);
    level after = refine(&next, options);
    tw_mesh again = sculpt(&next, options, after.points, arena);
    assert_ptr_equal(again.details, next.details);
    assert_ptr_equal(again.positions, next.positions);
    free_level(&after);
    free_level(&before);
    free(points);
    mesh = next;
  }
  tw_arena_destroy(arena);
}

TEST(a_level_has_the_points_that_it_was_given) {
  static const uint32_t up[] = {0, 1, 2, 3, 4}, down[] = {4, 2, 1, 0}, twice[] = {3, 3};
  uint32_t number = 0;
  for (int kind = TORUS_TRIANGLES; kind <= TORUS_QUADS; kind++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++) {
      if (number++ % test_stride() != 0) continue;
      cage *c = torus((torus_faces)kind, (torus_gaps)gaps, gaps == NO_GAPS);
      takes_points(&c->mesh, TW_CATMULL_CLARK, up, 5);
      takes_points(&c->mesh, TW_CATMULL_CLARK, down, 4);
      takes_points(&c->mesh, TW_CATMULL_CLARK, twice, 2);
      free(c);
      if (kind >= TORUS_MIXED) continue;
      c = torus((torus_faces)kind, (torus_gaps)gaps, false);
      takes_points(&c->mesh, TW_LOOP, up, 4);
      takes_points(&c->mesh, TW_LOOP, down, 4);
      free(c);
    }
}

TEST(a_cage_without_any_size_takes_points) {
  static const uint32_t up[] = {1, 2};
  cage *c = torus(TORUS_QUADS, NO_GAPS, false);
  memset(c->points, 0, c->mesh.point_count * sizeof *c->points);
  takes_points(&c->mesh, TW_CATMULL_CLARK, up, 2);
  free(c);
}

/* The surface of a mesh whose level 1 was modelled is that of the level as a mesh of its own: points, and
 * normals of the limit. */
static void goes_on(const tw_mesh *cage, tw_scheme scheme, uint32_t steps) {
  tw_arena *arena = tw_arena_create();
  level first = refine(cage, options_of(scheme, 1));
  float *points = moved_points(&first, 2);
  tw_mesh mesh = sculpt(cage, options_of(scheme, 1), points, arena), own = first.mesh;
  own.positions = points;
  tw_surface_options options = options_of(scheme, steps);
  options.normals = true;
  level there = refine(&own, options);
  options.level++;
  level here = refine(&mesh, options);
  uint32_t *here_rows = faces_of(&here.r, TW_DOMAIN_VERTICES),
           *there_rows = faces_of(&there.r, TW_DOMAIN_VERTICES);
  assert_int_equal(here.mesh.corner_count, there.mesh.corner_count);
  for (uint32_t i = 0; i < here.mesh.corner_count; i++) {
    const float *a = here.r.values + here.r.layout->stride * here_rows[i],
                *b = there.r.values + there.r.layout->stride * there_rows[i];
    assert_true(greatest_difference(a, b, 3) < 5e-6f);
    assert_true(greatest_difference(a + 3, b + 3, 3) < 1e-3f);
  }
  free(here_rows);
  free(there_rows);
  free_level(&there);
  free_level(&here);
  free_level(&first);
  free(points);
  tw_arena_destroy(arena);
}

TEST(levels_above_go_on_from_it) {
  cage *c = torus(TORUS_TRIANGLES, NO_GAPS, false);
  goes_on(&c->mesh, TW_LOOP, 1);
  free(c);
  for (int kind = TORUS_TRIANGLES; kind <= TORUS_MIXED; kind++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++)
      for (uint32_t steps = 1; steps <= 3; steps++) {
        c = torus((torus_faces)kind, (torus_gaps)gaps, true);
        goes_on(&c->mesh, TW_CATMULL_CLARK, steps);
        free(c);
      }
}

enum { JOINTS = 5 };

/* A cage that bears all that rows can hold. */
typedef struct dressed {
  cage *c;
  float uvs[4 * FACES_MAX][2], colors[POINTS_MAX][4], morph[POINTS_MAX][3];
  uint32_t uv_corners[4 * FACES_MAX];
  uint16_t joints[POINTS_MAX][4];
  float weights[POINTS_MAX][4];
  tw_uv_set set;
  tw_attribute attribute;
  const float *morphs[1];
} dressed;

/* UVs are parted at some faces; the others have the points' places on the torus. */
static dressed *dress(cage *c) {
  dressed *d = calloc(1, sizeof *d);
  assert_non_null(d);
  d->c = c;
  tw_mesh *m = &c->mesh;
  uint32_t values = m->point_count;
  for (uint32_t p = 0; p < m->point_count; p++) {
    d->uvs[p][0] = (float)(p % TORUS_SIDE);
    d->uvs[p][1] = (float)(p / TORUS_SIDE);
    for (uint32_t i = 0; i < 4; i++) d->colors[p][i] = (float)((p * (i + 2)) % 7) / 7;
    for (uint32_t i = 0; i < 3; i++) d->morph[p][i] = 0.1f * (float)((p + i) % 4);
    d->joints[p][0] = (uint16_t)(p % JOINTS);
    d->joints[p][1] = (uint16_t)((p + 1) % JOINTS);
    d->weights[p][0] = 0.75f;
    d->weights[p][1] = 0.25f;
  }
  for (uint32_t f = 0; f < m->face_count; f++)
    for (uint32_t k = c->offsets[f]; k < c->offsets[f + 1]; k++) {
      d->uv_corners[k] = f % 7 == 3 ? values++ : c->corners[k];
      if (f % 7 == 3)
        for (uint32_t i = 0; i < 2; i++) d->uvs[values - 1][i] = d->uvs[c->corners[k]][i] + (float)f;
    }
  d->set = (tw_uv_set){.value_count = values, .values = d->uvs[0], .corners = d->uv_corners};
  d->attribute = (tw_attribute){.name = "COLOR_0", .width = 4, .is_color = true, .values = d->colors[0]};
  d->morphs[0] = d->morph[0];
  m->uv_set_count = 1;
  m->uv_sets[0] = d->set;
  m->attribute_count = m->morph_count = 1;
  m->attributes = &d->attribute;
  m->morphs = d->morphs;
  m->skin.width = 4;
  m->skin.joints = d->joints[0];
  m->skin.weights = d->weights[0];
  return d;
}

static void weights_of(const tw_surface_layout *l, const float *row, float out[JOINTS]) {
  memset(out, 0, JOINTS * sizeof *out);
  for (uint32_t i = 0; i < 4; i++) out[(uint32_t)row[l->joints + i]] += row[l->weights + i];
}

static void same_rows(const tw_mesh *one, const tw_mesh *other, tw_surface_options options) {
  rows a = read_rows(one, options), b = read_rows(other, options);
  uint32_t *a_faces = faces_of(&a, TW_DOMAIN_VERTICES), *b_faces = faces_of(&b, TW_DOMAIN_VERTICES);
  const tw_surface_layout *l = a.layout;
  assert_int_equal(a.count, b.count);
  for (uint64_t c = 0; c < tw_surface_get_counts(a.surface)->corners; c++) {
    const float *p = a.values + (size_t)l->stride * a_faces[c],
                *q = b.values + (size_t)l->stride * b_faces[c];
    float of_p[JOINTS], of_q[JOINTS];
    assert_true(greatest_difference(p, q, 3) < 1e-5f);
    assert_true(greatest_difference(p + 3, q + 3, 3) < 1e-3f);
    if (l->tangent != UINT32_MAX) assert_true(greatest_difference(p + l->tangent, q + l->tangent, 4) < 1e-3f);
    assert_true(greatest_difference(p + l->uvs[0], q + l->uvs[0], l->joints - l->uvs[0]) < 1e-5f);
    assert_true(greatest_difference(p + l->morphs, q + l->morphs, 3) < 1e-5f);
    weights_of(l, p, of_p);
    weights_of(l, q, of_q);
    assert_true(greatest_difference(of_p, of_q, JOINTS) < 1e-5f);
  }
  free(a_faces);
  free(b_faces);
  free_rows(&a);
  free_rows(&b);
}

TEST(all_that_a_mesh_bears_goes_on_from_a_level_with_a_detail) {
  for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++) {
    dressed *d = dress(torus(TORUS_MIXED, (torus_gaps)gaps, false));
    crease_some(d->c, 2.5f);
    for (uint32_t at = 1; at <= 2; at++) {
      level base = refine(&d->c->mesh, options_of(TW_CATMULL_CLARK, at));
      float *offsets = calloc(base.mesh.point_count, 3 * sizeof *offsets);
      assert_non_null(offsets);
      const tw_detail detail = {at, base.mesh.point_count, offsets};
      tw_mesh mesh = d->c->mesh;
      mesh.detail_count = 1;
      mesh.details = &detail;
      for (uint32_t depth = at + 1; depth <= 3; depth++)
        for (int kind = 0; kind < 4; kind++) {
          tw_surface_options options = options_of(TW_CATMULL_CLARK, depth);
          options.normals = true;
          options.limit = kind % 2;
          /* Which way round a face's map is has to be the same for its children. */
          d->c->mesh.has_tangents = mesh.has_tangents = kind / 2;
          options.uv = kind / 2 ? TW_UV_ALL : TW_UV_CORNERS_ONLY;
          same_rows(&d->c->mesh, &mesh, options);
        }
      free(offsets);
      free_level(&base);
    }
    free(d->c);
    free(d);
  }
}

/* Turned by a quarter about y, moved, and three times as large. */
static void move_rigidly(const float *in, uint32_t count, float *out) {
  for (uint32_t i = 0; i < count; i++, in += 3, out += 3) {
    out[0] = 3 * in[2] + 1;
    out[1] = 3 * in[1] - 2;
    out[2] = -3 * in[0] + 5;
  }
}

TEST(what_is_modelled_moves_with_the_cage) {
  for (uint32_t depth = 0; depth <= 4; depth++) {
    cage *c = torus(TORUS_MIXED, GAPS, false);
    tw_arena *arena = tw_arena_create();
    level second = refine(&c->mesh, options_of(TW_CATMULL_CLARK, 2));
    float *points = moved_points(&second, 1);
    tw_mesh mesh = sculpt(&c->mesh, options_of(TW_CATMULL_CLARK, 2), points, arena);
    tw_surface_options options = options_of(TW_CATMULL_CLARK, depth);
    options.normals = true;
    level still = refine(&mesh, options);
    float *wanted = malloc(3 * still.mesh.point_count * sizeof *wanted);
    float *positions = malloc(3 * mesh.point_count * sizeof *positions);
    assert_true(wanted && positions);
    move_rigidly(still.points, still.mesh.point_count, wanted);
    move_rigidly(mesh.positions, mesh.point_count, positions);
    tw_mesh moved = mesh;
    moved.positions = positions;
    has_points(&moved, options, wanted, 3e-5f);
    /* The same bytes from a plan. */
    tw_surface *plan, *surface;
    tw_error error;
    options.movable = true;
    assert_int_equal(tw_surface_create(&mesh, &options, &plan, &error), TW_OK);
    assert_int_equal(tw_surface_with_positions_by(plan, positions, NULL, &surface), TW_OK);
    rows fresh = read_rows(&moved, options);
    float *planned = all_rows(surface, TW_DOMAIN_VERTICES);
    assert_memory_equal(planned, fresh.values, fresh.count * fresh.layout->stride * sizeof *planned);
    tw_surface_destroy(surface);
    tw_surface_destroy(plan);
    free_rows(&fresh);
    free(planned);
    free(positions);
    free(wanted);
    free(points);
    free_level(&still);
    free_level(&second);
    tw_arena_destroy(arena);
    free(c);
  }
}

/* A vertex of a lower level goes where it goes on the level that was modelled. */
TEST(levels_below_follow) {
  cage *c = torus(TORUS_MIXED, NO_GAPS, false);
  tw_arena *arena = tw_arena_create();
  level second = refine(&c->mesh, options_of(TW_CATMULL_CLARK, 2));
  float *points = moved_points(&second, 1);
  tw_mesh mesh = sculpt(&c->mesh, options_of(TW_CATMULL_CLARK, 2), points, arena);
  for (uint32_t depth = 0; depth < 2; depth++) {
    level plain = refine(&c->mesh, options_of(TW_CATMULL_CLARK, depth)),
          follows = refine(&mesh, options_of(TW_CATMULL_CLARK, depth));
    for (uint32_t i = 0; i < 3 * plain.mesh.point_count; i++)
      assert_true(fabsf(follows.points[i] - plain.points[i] - (points[i] - second.points[i])) < 2e-6f);
    free_level(&plain);
    free_level(&follows);
  }
  free(points);
  free_level(&second);
  tw_arena_destroy(arena);
  free(c);
}

TEST(details_of_other_meshes_are_refused) {
  float offsets[3 * 98] = {0};
  const struct {
    tw_detail detail;
    tw_status status;
  } cases[] = {{{1, 26, offsets}, TW_OK},
               {{2, 98, offsets}, TW_OK},
               {{1, 25, offsets}, TW_INVALID},
               {{2, 26, offsets}, TW_INVALID},
               {{16, 98, offsets}, TW_INVALID}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    tw_mesh mesh = cube();
    tw_error error = {0};
    tw_surface *surface;
    mesh.detail_count = 1;
    mesh.details = &cases[i].detail;
    const tw_surface_options options = options_of(TW_CATMULL_CLARK, 1);
    assert_int_equal(tw_mesh_check_details(&mesh, &error), cases[i].status);
    assert_int_equal(tw_surface_create(&mesh, &options, &surface, &error), cases[i].status);
    if (cases[i].status == TW_OK) tw_surface_destroy(surface);
    assert_string_equal(error.pointer, cases[i].status == TW_OK ? "" : "/details/0");
  }
  tw_mesh mesh = cube();
  tw_arena *arena = tw_arena_create();
  tw_mesh out;
  tw_error error;
  const tw_surface_options options = options_of(TW_CATMULL_CLARK, 1);
  float points[3 * 26] = {0};
  points[7] = NAN;
  assert_int_equal(tw_mesh_sculpt(&mesh, &options, points, NULL, NULL, arena, &out, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/2/1");
  /* Of so small a cube it would be more edges away than an offset may be. */
  float small[8][3];
  for (int i = 0; i < 24; i++) small[i / 3][i % 3] = 1e-3f * cube_points[i / 3][i % 3];
  mesh.positions = small[0];
  points[7] = 0.9e18f;
  assert_int_equal(tw_mesh_sculpt(&mesh, &options, points, NULL, NULL, arena, &out, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/2");
  tw_arena_destroy(arena);
}

TEST(offsets_of_any_size_leave_points_where_a_mesh_may_have_them) {
  float first[3 * 26], second[3 * 98];
  for (size_t i = 0; i < 3 * 26; i++) first[i] = i % 2 ? 1e35f : -3e38f;
  for (size_t i = 0; i < 3 * 98; i++) second[i] = i % 3 ? 1e35f : -1;
  const tw_detail details[] = {{1, 26, first}, {2, 98, second}};
  tw_mesh mesh = cube();
  mesh.detail_count = 2;
  mesh.details = details;
  for (uint32_t depth = 0; depth < 4; depth++) {
    level at = refine(&mesh, options_of(TW_CATMULL_CLARK, depth));
    for (size_t i = 0; i < 3 * (size_t)at.mesh.point_count; i++)
      assert_true(fabsf(at.points[i]) <= TW_COORDINATE_MAX);
    free_level(&at);
  }
}

/* A point of the limit surface has to be moved farther than its vertex may be. */
TEST(a_level_0_whose_points_would_leave_the_range_is_refused) {
  float points[8][3], wanted[8][3];
  tw_mesh mesh = cube(), out;
  for (int v = 0; v < 8; v++)
    for (int c = 0; c < 3; c++) wanted[v][c] = points[v][c] = cube_points[v][c] * TW_COORDINATE_MAX;
  mesh.positions = points[0];
  tw_surface_options options = options_of(TW_CATMULL_CLARK, 0);
  options.limit = true;
  tw_arena *arena = tw_arena_create();
  tw_error error;
  assert_int_equal(tw_mesh_sculpt(&mesh, &options, wanted[0], NULL, NULL, arena, &out, &error), TW_INVALID);
  assert_string_equal(error.pointer, "/positions/0");
  tw_arena_destroy(arena);
}
