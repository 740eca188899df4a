/* Edits of a mesh, tried on it, and what must hold of whatever comes out. */
#ifndef EDITED_H
#define EDITED_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cube.h"
#include "test.h"
#include "tweend/edit.h"

enum { MADE_MAX = 16 };

typedef struct edited {
  tw_arena *arena;
  tw_mesh mesh;
  tw_mesh_stats stats;
  tw_made made[MADE_MAX];
  uint32_t made_count;
} edited;

static const tw_edit_limits roomy = {1 << 20, 1 << 20, 1 << 22, 1 << 24};

static inline void edited_deinit(edited *e) {
  tw_mesh_stats_deinit(&e->stats);
  tw_arena_destroy(e->arena);
}

static inline edited edit_with(const tw_mesh *mesh, const tw_model *model, const tw_edit *edits,
                               uint32_t count) {
  edited out = {.arena = tw_arena_create()};
  tw_error error = {0};
  assert_non_null(out.arena);
  assert_true(count <= MADE_MAX);
  tw_status status = tw_mesh_edit(mesh, model, edits, count, &roomy, out.arena, &out.mesh, out.made,
                                  &out.made_count, &error);
  if (status == TW_OK) status = tw_mesh_check(&out.mesh, &error, NULL);
  if (status != TW_OK) print_error("%s: %s\n", error.pointer, error.detail);
  assert_int_equal(status, TW_OK);
  assert_int_equal(tw_mesh_describe(&out.mesh, &out.stats, NULL), TW_OK);
  return out;
}

static inline edited edit(const tw_mesh *mesh, const tw_edit *edits, uint32_t count) {
  return edit_with(mesh, NULL, edits, count);
}

/* The last of the edits must be refused. */
static inline void edit_refused(const tw_mesh *mesh, const tw_edit *edits, uint32_t count, tw_status expected,
                                const char *pointer) {
  tw_arena *arena = tw_arena_create();
  tw_mesh untouched;
  tw_error error = {0};
  tw_status status = tw_mesh_edit(mesh, NULL, edits, count, &roomy, arena, &untouched, NULL, NULL, &error);
  if (status != expected || strcmp(error.pointer, pointer) != 0)
    print_error("status %d, %s: %s\n", (int)status, error.pointer, error.detail);
  assert_int_equal(status, expected);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  tw_arena_destroy(arena);
}

/* Counts of vertices, edges, faces and border edges; and that it is manifold where it is said to be. */
static inline void assert_counts(const edited *e, uint32_t vertices, uint32_t edges, uint32_t faces,
                                 uint32_t border) {
  const tw_mesh_stats *s = &e->stats;
  if (s->vertices != vertices || s->edges != edges || s->faces != faces || s->boundary_edges != border)
    print_error("V %u E %u F %u border %u\n", s->vertices, s->edges, s->faces, s->boundary_edges);
  assert_int_equal(s->vertices, vertices);
  assert_int_equal(s->edges, edges);
  assert_int_equal(s->faces, faces);
  assert_int_equal(s->boundary_edges, border);
  assert_int_equal(s->unused_points, 0);
  assert_int_equal(s->nonmanifold_edges, 0);
  assert_int_equal(s->nonmanifold_vertices, 0);
  assert_int_equal(s->reversed_edges, 0);
}

static inline const float *point_of(const tw_mesh *mesh, uint32_t point) {
  return mesh->positions + 3 * (size_t)point;
}

/* Six times the volume of each triangle with the origin; twice the area. */
static inline void measure(const tw_mesh *mesh, double *volume, double *area) {
  *volume = *area = 0;
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    const float *a = point_of(mesh, mesh->corners[mesh->face_offsets[f]]);
    double normal[3] = {0, 0, 0};
    for (uint32_t c = mesh->face_offsets[f] + 1; c + 1 < mesh->face_offsets[f + 1]; c++) {
      const float *b = point_of(mesh, mesh->corners[c]), *d = point_of(mesh, mesh->corners[c + 1]);
      double u[3], v[3], part[3];
      for (int i = 0; i < 3; i++) {
        u[i] = (double)b[i] - (double)a[i];
        v[i] = (double)d[i] - (double)a[i];
      }
      for (int i = 0; i < 3; i++) {
        part[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
        normal[i] += part[i];
        *volume += (double)a[i] * part[i] / 6;
      }
    }
    *area += sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) / 2;
  }
}

#define LIST(what, ...)                                                                                      \
  {                                                                                                          \
    .of = what, .by = TW_SELECT_LIST,                                                                        \
    .count =                                                                                                 \
        (uint32_t)(sizeof((uint32_t[]){__VA_ARGS__}) / sizeof(uint32_t) / (what == TW_EDIT_EDGES ? 2 : 1)),  \
    .indices = (const uint32_t[]) {                                                                          \
      __VA_ARGS__                                                                                            \
    }                                                                                                        \
  }

#endif
