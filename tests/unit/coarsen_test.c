/* Refined meshes and the cages that they came of: the way back finds the same faces, and points whose surface
 * is the refined mesh. */
#include "host.h"
#include "tweend/coarsen.h"

#include <stdio.h>
#include <string.h>

#include "cube.h"
#include "refined_mesh.h"
#include "torus_cage.h"

/* Takes a level of the cage back, as far as it goes. */
static void comes_back(const tw_mesh *cage, tw_surface_options options) {
  level fine = refine(cage, options);
  tw_arena *arena = tw_arena_create();
  tw_surface_options back = options;
  tw_coarsened found;
  tw_error error;
  back.level = TW_LEVEL_MAX;
  if (tw_mesh_coarsen(&fine.mesh, &back, NULL, arena, &found, &error) != TW_OK)
    fail_msg("level %u: %s %s", options.level, error.pointer, error.detail);
  assert_int_equal(found.levels, options.level);
  assert_int_equal(found.mesh.face_count, cage->face_count);
  assert_int_equal(found.mesh.corner_count, cage->corner_count);
  assert_memory_equal(found.mesh.face_offsets, cage->face_offsets, cage->face_count * sizeof(uint32_t));
  assert_int_equal(tw_mesh_check(&found.mesh, &error, NULL), TW_OK);
  level again = refine(&found.mesh, options);
  assert_int_equal(again.mesh.point_count, fine.mesh.point_count);
  assert_memory_equal(again.mesh.corners, fine.mesh.corners, fine.mesh.corner_count * sizeof(uint32_t));
  float difference = greatest_difference(again.points, fine.points, 3 * (size_t)fine.mesh.point_count);
  if (difference > 1e-5f) fail_msg("level %u is missed by %g", options.level, (double)difference);
  free_level(&again);
  tw_arena_destroy(arena);
  free_level(&fine);
}

TEST(quads_come_back) {
  for (int kind = TORUS_TRIANGLES; kind <= TORUS_QUADS; kind++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++) {
      cage *c = torus((torus_faces)kind, (torus_gaps)gaps, false);
      for (uint32_t depth = 1; depth <= 3; depth++) {
        comes_back(&c->mesh, options_of(TW_CATMULL_CLARK, depth));
      }
      free(c);
    }
}

TEST(triangles_come_back) {
  for (int kind = TORUS_TRIANGLES; kind <= TORUS_TURNED_TRIANGLES; kind++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++) {
      cage *c = torus((torus_faces)kind, (torus_gaps)gaps, false);
      for (uint32_t depth = 1; depth <= 3; depth++) {
        comes_back(&c->mesh, options_of(TW_LOOP, depth));
      }
      free(c);
    }
}

/* The tags that edges have one level below: both halves of a crease. */
static void pass_creases_on(const tw_mesh *cage, level *fine, float sharpness, uint32_t *edges, float *tags) {
  uint32_t count = 0;
  for (uint32_t i = 0; i < cage->crease_count; i++)
    for (uint32_t c = 0; c < cage->corner_count; c++) {
      const uint32_t *quad = fine->corners + 4 * c;
      bool starts = quad[0] == cage->crease_edges[2 * i], ends = quad[0] == cage->crease_edges[2 * i + 1];
      if (!starts && !ends) continue;
      /* The middle of the crease is next to both of its ends. */
      for (uint32_t other = 0; starts && other < cage->corner_count; other++) {
        const uint32_t *there = fine->corners + 4 * other;
        if (there[0] != cage->crease_edges[2 * i + 1] || (there[3] != quad[1] && there[1] != quad[1]))
          continue;
        memcpy(edges + 2 * count, (uint32_t[]){quad[0], quad[1], quad[1], there[0]}, 4 * sizeof *edges);
        tags[count++] = sharpness;
        tags[count++] = sharpness;
        break;
      }
    }
  fine->mesh.crease_count = count;
  fine->mesh.crease_edges = edges;
  fine->mesh.crease_sharpness = tags;
}

TEST(creases_were_sharper_a_level_above) {
  static const float before[] = {TW_SHARPNESS_INFINITE, 3, 1.5f}, after[] = {TW_SHARPNESS_INFINITE, 2, 0.5f};
  for (int i = 0; i < 3; i++) {
    cage *c = torus(TORUS_MIXED, NO_GAPS, false);
    crease_some(c, before[i]);
    level fine = refine(&c->mesh, options_of(TW_CATMULL_CLARK, 1));
    uint32_t edges[64];
    float tags[32];
    pass_creases_on(&c->mesh, &fine, after[i], edges, tags);
    assert_true(fine.mesh.crease_count >= 8);
    tw_arena *arena = tw_arena_create();
    tw_coarsened found;
    tw_error error;
    tw_surface_options once = options_of(TW_CATMULL_CLARK, 1);
    assert_int_equal(tw_mesh_coarsen(&fine.mesh, &once, NULL, arena, &found, &error), TW_OK);
    assert_int_equal(found.mesh.crease_count, 4);
    assert_int_equal(found.untagged, 0);
    for (uint32_t k = 0; k < 4; k++) assert_true(fabsf(found.mesh.crease_sharpness[k] - before[i]) < 1e-6f);
    assert_true(found.error < 1e-5);
    tw_arena_destroy(arena);
    free_level(&fine);
    free(c);
  }
}

/* Of what a step cannot make, the half of an edge is sharp without the other, or less so, or an edge or a
 * point inside a face. */
TEST(tags_that_no_step_makes_are_counted) {
  tw_mesh mesh = cube();
  level fine = refine(&mesh, options_of(TW_CATMULL_CLARK, 1));
  const uint32_t *quad = fine.corners; /* a point of the cube, a middle of an edge, of the face, of an edge */
  const uint32_t edges[] = {quad[0], quad[1], quad[1], quad[2], quad[0], quad[3]};
  const float tags[] = {2, 1, 3};
  uint32_t beyond = UINT32_MAX, far[8];
  for (uint32_t c = 0; c < mesh.corner_count; c++) /* the other half of the first edge */
    if (fine.corners[4 * c + 1] == quad[1] && fine.corners[4 * c] != quad[0]) beyond = fine.corners[4 * c];
  assert_true(beyond != UINT32_MAX);
  memcpy(far, edges, sizeof edges);
  far[6] = quad[1];
  far[7] = beyond;
  const float half[] = {2, 1, 3, 1};
  for (int i = 0; i < 2; i++) {
    fine.mesh.crease_count = i ? 4 : 3;
    fine.mesh.crease_edges = i ? far : edges;
    fine.mesh.crease_sharpness = i ? half : tags;
    fine.mesh.sharp_point_count = 1;
    fine.mesh.sharp_points = quad + 2;
    fine.mesh.point_sharpness = tags;
    tw_arena *arena = tw_arena_create();
    tw_coarsened found;
    tw_surface_options once = options_of(TW_CATMULL_CLARK, 1);
    assert_int_equal(tw_mesh_coarsen(&fine.mesh, &once, NULL, arena, &found, NULL), TW_OK);
    assert_int_equal(found.mesh.crease_count, i);
    if (i) assert_true(found.mesh.crease_sharpness[0] == 2);
    assert_int_equal(found.untagged, 4);
    tw_arena_destroy(arena);
  }
  free_level(&fine);
}

TEST(what_alternates_in_a_cube_is_left_out) {
  float points[8][3];
  tw_mesh mesh = cube();
  memcpy(points, cube_points, sizeof points);
  for (int i = 0; i < 8; i++) {
    bool odd = (points[i][0] > 0) ^ (points[i][1] > 0) ^ (points[i][2] > 0);
    points[i][1] += odd ? 0.25f : -0.25f;
  }
  mesh.positions = points[0];
  level fine = refine(&mesh, options_of(TW_CATMULL_CLARK, 1));
  tw_arena *arena = tw_arena_create();
  tw_coarsened found;
  tw_error error;
  tw_surface_options back = options_of(TW_CATMULL_CLARK, TW_LEVEL_MAX);
  assert_int_equal(tw_mesh_coarsen(&fine.mesh, &back, NULL, arena, &found, &error), TW_OK);
  assert_true(found.is_ambiguous);
  assert_true(found.error < 1e-5);
  assert_true(greatest_difference(found.mesh.positions, cube_points[0], 24) < 1e-5f);
  tw_arena_destroy(arena);
  free_level(&fine);
}

TEST(pieces_choose_for_themselves) {
  level pair[2];
  cage *c = torus(TORUS_MIXED, NO_GAPS, false);
  tw_mesh box = cube();
  pair[0] = refine(&c->mesh, options_of(TW_CATMULL_CLARK, 2));
  pair[1] = refine(&box, options_of(TW_CATMULL_CLARK, 2));
  tw_mesh both = pair[0].mesh;
  float *points = malloc((pair[0].mesh.point_count + pair[1].mesh.point_count) * 3 * sizeof *points);
  uint32_t *corners = malloc((pair[0].mesh.corner_count + pair[1].mesh.corner_count) * sizeof *corners);
  uint32_t *offsets = malloc((pair[0].mesh.face_count + pair[1].mesh.face_count + 1) * sizeof *offsets);
  assert_true(points && corners && offsets);
  uint32_t point = 0, corner = 0;
  for (int i = 0; i < 2; i++) {
    memcpy(points + 3 * point, pair[i].points, pair[i].mesh.point_count * 3 * sizeof *points);
    for (uint32_t k = 0; k < pair[i].mesh.corner_count; k++) corners[corner++] = pair[i].corners[k] + point;
    point += pair[i].mesh.point_count;
  }
  both.point_count = point;
  both.corner_count = corner;
  both.face_count = corner / 4;
  for (uint32_t f = 0; f <= both.face_count; f++) offsets[f] = 4 * f;
  both.positions = points;
  both.corners = corners;
  both.face_offsets = offsets;
  tw_arena *arena = tw_arena_create();
  tw_coarsened found;
  tw_error error;
  tw_surface_options back = options_of(TW_CATMULL_CLARK, TW_LEVEL_MAX);
  assert_int_equal(tw_mesh_coarsen(&both, &back, NULL, arena, &found, &error), TW_OK);
  assert_int_equal(found.levels, 2);
  assert_int_equal(found.mesh.face_count, c->mesh.face_count + 6);
  assert_true(found.error < 1e-5);
  tw_arena_destroy(arena);
  free(points);
  free(corners);
  free(offsets);
  free_level(&pair[0]);
  free_level(&pair[1]);
  free(c);
}

static void is_no_refinement(const tw_mesh *mesh, tw_scheme scheme, const char *place) {
  tw_arena *arena = tw_arena_create();
  tw_coarsened found;
  tw_error error;
  tw_surface_options back = options_of(scheme, 1);
  assert_int_equal(tw_mesh_coarsen(mesh, &back, NULL, arena, &found, &error), TW_INVALID);
  assert_string_equal(error.pointer, place);
  tw_arena_destroy(arena);
}

TEST(what_is_no_refinement_says_so) {
  tw_mesh box = cube();
  cage *mixed = torus(TORUS_MIXED, NO_GAPS, false),
       *triangles = torus(TORUS_TURNED_TRIANGLES, NO_GAPS, false), *odd = grid(4, 3, false, NULL),
       *empty = new_cage();
  is_no_refinement(&box, TW_CATMULL_CLARK, "/faces/0");
  is_no_refinement(&mixed->mesh, TW_CATMULL_CLARK, "/faces/0");
  is_no_refinement(&triangles->mesh, TW_LOOP, "/faces/0");
  is_no_refinement(&odd->mesh, TW_CATMULL_CLARK, "/faces/0");
  is_no_refinement(&empty->mesh, TW_CATMULL_CLARK, "");
  is_no_refinement(&box, TW_BILINEAR, "");
  free(mixed);
  free(triangles);
  free(odd);
  free(empty);
}

/* The piece that is no refinement is named, not the first one. */
TEST(the_face_that_is_no_child_is_named) {
  tw_mesh box = cube();
  level fine = refine(&box, options_of(TW_CATMULL_CLARK, 1));
  uint32_t faces = fine.mesh.face_count, corners = fine.mesh.corner_count;
  uint32_t *offsets = malloc((faces + 2) * sizeof *offsets),
           *all = malloc(((size_t)corners + 3) * sizeof *all);
  memcpy(offsets, fine.mesh.face_offsets, ((size_t)faces + 1) * sizeof *offsets);
  memcpy(all, fine.mesh.corners, corners * sizeof *all);
  offsets[faces + 1] = corners + 3;
  for (uint32_t i = 0; i < 3; i++) all[corners + i] = fine.mesh.corners[i]; /* a triangle on a face */
  tw_mesh mesh = fine.mesh;
  mesh.face_count++;
  mesh.corner_count += 3;
  mesh.face_offsets = offsets;
  mesh.corners = all;
  char place[32];
  snprintf(place, sizeof place, "/faces/%u", faces);
  is_no_refinement(&mesh, TW_CATMULL_CLARK, place);
  free(offsets);
  free(all);
  free_level(&fine);
}

static void counts_parted(const tw_mesh *cage, tw_scheme scheme, uint32_t parted) {
  tw_mesh box = *cage;
  level fine = refine(&box, options_of(scheme, 1));
  int32_t *materials = calloc(fine.mesh.face_count, sizeof *materials);
  tw_mesh mesh = fine.mesh;
  tw_surface_options back = options_of(scheme, 1);
  for (uint32_t last = 0; last < 2; last++) {
    tw_arena *arena = tw_arena_create();
    tw_coarsened found;
    tw_error error;
    /* The last child alone is of another material. */
    for (uint32_t f = 0; f < parted; f++) materials[4 * f + 3] = (int32_t)last;
    mesh.face_materials = materials;
    assert_int_equal(tw_mesh_coarsen(&mesh, &back, NULL, arena, &found, &error), TW_OK);
    assert_int_equal(found.parted, last == 0 ? 0 : parted);
    tw_arena_destroy(arena);
  }
  free(materials);
  free_level(&fine);
}

TEST(faces_whose_children_differ_are_counted) {
  cage *quads = torus(TORUS_QUADS, NO_GAPS, false), *triangles = torus(TORUS_TRIANGLES, NO_GAPS, false);
  counts_parted(&quads->mesh, TW_CATMULL_CLARK, 5);
  counts_parted(&triangles->mesh, TW_LOOP, 3);
  free(quads);
  free(triangles);
}

TEST(a_cage_that_nobody_wants_any_more_is_not_found) {
  cage *c = torus(TORUS_MIXED, NO_GAPS, false);
  level fine = refine(&c->mesh, options_of(TW_CATMULL_CLARK, 2));
  const tw_surface_options back = options_of(TW_CATMULL_CLARK, TW_LEVEL_MAX);
  for (uint32_t wanted = 0; wanted < 100; wanted += 33) {
    uint32_t left = wanted;
    const tw_parallel_for parallel = {.owner = &left, .is_cancelled = wants_no_more};
    tw_arena *arena = tw_arena_create();
    tw_coarsened found;
    tw_error error = {0};
    assert_int_equal(tw_mesh_coarsen(&fine.mesh, &back, &parallel, arena, &found, &error), TW_CANCELLED);
    assert_int_equal(error.status, TW_CANCELLED);
    tw_arena_destroy(arena);
  }
  free_level(&fine);
  free(c);
}

/* What no cage's surface is comes back as a cage with a detail, by which its surface is that mesh. */
static void rough_comes_back(const cage *c, tw_scheme scheme, uint32_t levels) {
  level fine = refine(&c->mesh, options_of(scheme, levels));
  for (uint32_t i = 0; i < 3 * fine.mesh.point_count; i++) fine.points[i] += 0.01f * (float)(i * i % 7);
  tw_arena *arena = tw_arena_create();
  tw_coarsened found;
  tw_error error;
  tw_surface_options back = options_of(scheme, levels);
  if (tw_mesh_coarsen(&fine.mesh, &back, NULL, arena, &found, &error) != TW_OK)
    fail_msg("level %u: %s %s", levels, error.pointer, error.detail);
  assert_false(found.fits);
  assert_int_equal(found.levels, levels);
  assert_int_equal(found.mesh.detail_count, 1);
  level again = refine(&found.mesh, options_of(scheme, levels));
  assert_int_equal(again.mesh.point_count, fine.mesh.point_count);
  assert_memory_equal(again.mesh.corners, fine.mesh.corners, fine.mesh.corner_count * sizeof(uint32_t));
  float difference = greatest_difference(again.points, fine.points, 3 * (size_t)fine.mesh.point_count);
  if (difference > 2e-6f) fail_msg("level %u is missed by %g", levels, (double)difference);
  free_level(&again);
  tw_arena_destroy(arena);
  free_level(&fine);
}

TEST(what_is_rough_keeps_its_points) {
  for (int kind = TORUS_TRIANGLES; kind <= TORUS_QUADS; kind++)
    for (int gaps = NO_GAPS; gaps <= GAPS_THAT_TOUCH; gaps++) {
      cage *c = torus((torus_faces)kind, (torus_gaps)gaps, false);
      for (uint32_t levels = 1; levels <= 2; levels++) {
        rough_comes_back(c, TW_CATMULL_CLARK, levels);
        if (kind < TORUS_MIXED) rough_comes_back(c, TW_LOOP, levels);
      }
      if (kind == TORUS_TRIANGLES) rough_comes_back(c, TW_LOOP, 3);
      free(c);
    }
}
