/* Loop surfaces at deep levels, whose triangles are computed when they are read: their rows are those of
 * generic steps, which tests/oracle compares with OpenSubdiv. */
#include <math.h>

#include "built_cage.h"
#include "cage.h"
#include "limit.h"
#include "loop_lattice.h"
#include "refine.h"
#include "surface.h"
#include "torus_cage.h"
#include "wrapped_memory.h"

/* ---- lattices ------------------------------------------------------------------------------- */

static tw_cage read_cage(const tw_mesh *mesh, const tw_surface_options *options, tw_arena *arena) {
  tw_cage out;
  assert_int_equal(tw_cage_read(mesh, options, arena, &out), TW_OK);
  return out;
}

static double *positions_of(const tw_mesh *mesh, const tw_cage *read) {
  double *out = malloc(3 * (size_t)read->topology.vertex_count * sizeof *out);
  assert_non_null(out);
  for (size_t v = 0; v < read->topology.vertex_count; v++)
    for (size_t c = 0; c < 3; c++)
      out[3 * v + c] = (double)mesh->positions[3 * (read->point_of ? read->point_of[v] : v) + c];
  return out;
}

/* Compares all points of a regular face with those of generic steps, beginning with each of its corners. */
static void compare_face(const tw_lattice_job *job, double *scratch) {
  uint32_t side = 1u << job->depth, face = job->faces[0];
  float *rows = malloc(tw_lattice_points(side) * 6 * sizeof *rows);
  assert_non_null(rows);
  assert_int_equal(tw_lattice_steps(job, rows), TW_OK);
  const tw_lattice_rect all = {0, (int32_t)side, 0, (int32_t)side};
  for (uint32_t turn = 0; turn < 3; turn++) {
    tw_lattice l = tw_lattice_refine(&job->source, 3 * face + turn, job->depth, all, scratch);
    for (uint32_t j = 0; j <= side; j++)
      for (uint32_t i = 0; i + j <= side; i++) {
        uint32_t at[3] = {side - i - j, i, j};
        float row[6];
        tw_lattice_value(&l, i, j, job->limit, row);
        tw_lattice_normal(&l, i, j, row + 3);
        const float *step = rows + 6 * tw_lattice_place(side, at[(4 - turn) % 3], at[(5 - turn) % 3]);
        for (int c = 0; c < 6; c++) assert_float_equal(row[c], step[c], c < 3 ? 1e-6f : 1e-5f);
      }
  }
  free(rows);
}

TEST(regular_triangles_are_those_of_generic_steps_at_all_depths) {
  const tw_surface_options options = {.scheme = TW_LOOP};
  const tw_rules rules = tw_rules_of(&options);
  cage *c = torus(TORUS_TRIANGLES, NO_GAPS, false);
  tw_arena *arena = tw_arena_create();
  tw_cage read = read_cage(&c->mesh, &options, arena);
  double *positions = positions_of(&c->mesh, &read);
  for (uint32_t depth = 1; depth <= TW_LATTICE_DEPTH_MAX; depth++) {
    double *scratch = malloc(tw_lattice_scratch(depth) * sizeof *scratch);
    assert_non_null(scratch);
    for (uint32_t face = 0; face < 3; face++) {
      assert_true(tw_lattice_is_regular(&read.topology, face));
      for (int limit = 0; limit < 2; limit++) {
        const tw_lattice_job job = {.source = {&read.topology, positions, NULL, 3},
                                    .rules = &rules,
                                    .faces = &face,
                                    .count = 1,
                                    .depth = depth,
                                    .limit = limit,
                                    .normals = true};
        compare_face(&job, scratch);
      }
    }
    free(scratch);
  }
  free(positions);
  tw_arena_destroy(arena);
  free(c);
}

TEST(generic_steps_survive_each_failing_allocation) {
  const tw_surface_options options = {.scheme = TW_LOOP, .creasing = TW_CREASE_CHAIKIN};
  const tw_rules rules = tw_rules_of(&options);
  cage *c = torus(TORUS_TURNED_TRIANGLES, GAPS, false);
  tw_arena *arena = tw_arena_create();
  tw_cage read = read_cage(&c->mesh, &options, arena);
  double *positions = positions_of(&c->mesh, &read);
  const uint32_t faces[2] = {0, 5};
  float rows[2 * 15 * 6];
  const tw_lattice_job job = {{&read.topology, positions, NULL, 3}, &rules, faces, 2, 2, true, true, NULL};
  tw_status status = TW_NO_MEMORY;
  uint32_t failures = 0;
  for (; status != TW_OK; failures++) {
    size_t held = test_memory.held;
    test_memory.left = failures;
    status = tw_lattice_steps(&job, rows);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK || status == TW_NO_MEMORY);
    assert_int_equal(test_memory.held, held);
  }
  assert_true(failures > 10);
  free(positions);
  tw_arena_destroy(arena);
  free(c);
}

/* ---- surfaces ------------------------------------------------------------------------------- */

/* A level by generic steps. */
typedef struct steps {
  tw_arena *arena;
  tw_topology topology;
  double *positions;
} steps;

static steps take_steps(const tw_mesh *mesh, const tw_surface_options *options) {
  const tw_rules rules = tw_rules_of(options);
  steps s = {.arena = tw_arena_create()};
  tw_cage read = read_cage(mesh, options, s.arena);
  s.topology = read.topology;
  s.positions = positions_of(mesh, &read);
  for (uint32_t level = 0; level < options->level; level++) {
    tw_topology child;
    assert_int_equal(tw_refine_topology(&s.topology, &rules, s.arena, NULL, &child), TW_OK);
    double *next = malloc(3 * child.vertex_count * sizeof *next);
    assert_non_null(next);
    assert_int_equal(tw_refine_values(&s.topology, &rules, 3, s.positions, NULL, next), TW_OK);
    free(s.positions);
    s.positions = next;
    s.topology = child;
  }
  return s;
}

static void limit_normal(const steps *s, uint32_t vertex, tw_limit_entry *room, double out[3]) {
  const tw_topology *t = &s->topology;
  uint32_t count = tw_limit_mask(t, false, t->fan_corners[t->fan_offsets[vertex]], room);
  double a[3] = {0}, b[3] = {0}, length = 0;
  for (uint32_t i = 0; i < count; i++)
    for (size_t c = 0; c < 3; c++) {
      double by = s->positions[3 * (size_t)room[i].vertex + c] - s->positions[3 * (size_t)vertex + c];
      a[c] += (double)room[i].tangent1 * by;
      b[c] += (double)room[i].tangent2 * by;
    }
  for (int c = 0; c < 3; c++) {
    out[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    length += out[c] * out[c];
  }
  for (int c = 0; c < 3; c++) out[c] /= sqrt(length);
}

static void compare_rows(const rows *r, const steps *s, const uint32_t *vertex_of) {
  tw_limit_entry *room = malloc(tw_limit_greatest_capacity(&s->topology) * sizeof *room);
  assert_int_equal(r->count, s->topology.vertex_count);
  for (size_t row = 0; row < r->count; row++) {
    const double *point = s->positions + 3 * (size_t)vertex_of[row];
    double normal[3];
    for (int c = 0; c < 3; c++) assert_float_equal(row_of(r, row)[c], point[c], 1e-6);
    if (r->layout->normal == UINT32_MAX) continue;
    limit_normal(s, vertex_of[row], room, normal);
    for (uint32_t c = 0; c < 3; c++)
      assert_float_equal(row_of(r, row)[r->layout->normal + c], normal[c], 1e-4);
  }
  free(room);
}

/* Each vertex has one row; each face of the surface is a face of the level. */
static void compare_faces(const rows *r, const steps *s, const uint32_t *vertex_of) {
  const tw_topology *t = &s->topology;
  uint32_t *faces = faces_of(r, TW_DOMAIN_VERTICES), seen = 0;
  uint8_t *is_seen = calloc(t->face_count, 1), *has_row = calloc(t->vertex_count, 1);
  for (size_t row = 0; row < r->count; row++) has_row[vertex_of[row]]++;
  for (uint32_t v = 0; v < t->vertex_count; v++) assert_int_equal(has_row[v], 1);
  for (uint32_t f = 0; f < t->face_count; f++) {
    uint32_t own[3];
    for (uint32_t k = 0; k < 3; k++) own[k] = vertex_of[faces[3 * (size_t)f + k]];
    for (uint32_t i = t->fan_offsets[own[0]]; i < t->fan_offsets[own[0] + 1]; i++) {
      uint32_t c = t->fan_corners[i];
      bool same = t->corner_vertex[tw_triangle_next(c)] == own[1] &&
                  t->corner_vertex[tw_triangle_previous(c)] == own[2];
      if (!same) continue;
      seen += !is_seen[c / 3];
      is_seen[c / 3] = 1;
    }
  }
  assert_int_equal(seen, t->face_count);
  free(faces);
  free(is_seen);
  free(has_row);
}

static void compare_with_steps(const tw_mesh *mesh, tw_surface_options options) {
  rows r = read_rows(mesh, options);
  steps s = take_steps(mesh, &options);
  uint32_t *vertex_of = malloc(r.count * sizeof *vertex_of);
  assert_non_null(vertex_of);
  assert_true(tw_surface_get_counts(r.surface)->faces > 1 << 20);
  tw_surface_vertices_of_points(r.surface, &s.topology, vertex_of);
  compare_rows(&r, &s, vertex_of);
  compare_faces(&r, &s, vertex_of);
  assert_exact_bounds(&r);
  assert_same_in_blocks(&r);
  assert_true(tw_surface_size(r.surface) < 16 << 20);
  free(vertex_of);
  free_rows(&r);
  free(s.positions);
  tw_arena_destroy(s.arena);
}

static float wavy(float x, float y) {
  return 0.3f * sinf(2 * x) * cosf(y);
}

TEST(deep_levels_with_borders_and_semi_sharp_creases_are_those_of_generic_steps) {
  cage *c = grid(4, 4, true, wavy);
  crease_some(c, 2.5f);
  compare_with_steps(&c->mesh, (tw_surface_options){.level = 8, .scheme = TW_LOOP, .normals = true});
  free(c);
}

TEST(deep_levels_with_infinite_creases_and_many_valences_are_those_of_generic_steps) {
  cage *c = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, true);
  crease_some(c, TW_SHARPNESS_INFINITE);
  c->sharpness[1] = 1.3f;
  compare_with_steps(&c->mesh,
                     (tw_surface_options){.level = 7, .scheme = TW_LOOP, .creasing = TW_CREASE_CHAIKIN});
  free(c);
}
