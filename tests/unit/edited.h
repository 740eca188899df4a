/* Applies edits to a mesh and asserts what must hold of the result. */
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
  tw_edit_losses losses;
} edited;

static const tw_edit_limits roomy = {
    .points = 1 << 20, .faces = 1 << 20, .corners = 1 << 22, .work = 1 << 24};

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
                                  &out.made_count, &out.losses, &error);
  if (status == TW_OK) status = tw_mesh_check(&out.mesh, &error, NULL);
  if (status != TW_OK) print_error("%s: %s\n", error.pointer, error.detail);
  assert_int_equal(status, TW_OK);
  assert_int_equal(tw_mesh_describe(&out.mesh, &out.stats, NULL), TW_OK);
  return out;
}

static inline edited edit(const tw_mesh *mesh, const tw_edit *edits, uint32_t count) {
  return edit_with(mesh, NULL, edits, count);
}

static inline edited edit_once(const tw_mesh *mesh, tw_edit one) {
  return edit_with(mesh, NULL, &one, 1);
}

/* Asserts that the edits are refused with this status and pointer. */
static inline void edit_refused(const tw_mesh *mesh, const tw_edit *edits, uint32_t count, tw_status expected,
                                const char *pointer) {
  tw_arena *arena = tw_arena_create();
  tw_mesh untouched;
  tw_error error = {0};
  tw_status status =
      tw_mesh_edit(mesh, NULL, edits, count, &roomy, arena, &untouched, NULL, NULL, NULL, &error);
  if (status != expected || strcmp(error.pointer, pointer) != 0)
    print_error("status %d, %s: %s\n", (int)status, error.pointer, error.detail);
  assert_int_equal(status, expected);
  assert_string_equal(error.pointer, pointer);
  assert_true(error.detail[0] != '\0');
  tw_arena_destroy(arena);
}

/* Asserts the numbers of vertices, edges, faces and border edges, and that the mesh is an oriented manifold
 * without unused points. */
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

/* Sums the signed volumes of the tetrahedra that the triangles form with the origin, and the areas of the
 * faces. */
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

static inline double volume_of(const tw_mesh *mesh) {
  double volume, area;
  measure(mesh, &volume, &area);
  return volume;
}

static inline double area_of(const tw_mesh *mesh) {
  double volume, area;
  measure(mesh, &volume, &area);
  return area;
}

/* ---- every kind of mesh data, as linear functions of the points' positions ------------------- */

enum { DRESSED_POINTS = 64, DRESSED_CORNERS = 256 };

typedef struct dressed {
  float weight[DRESSED_POINTS], color[DRESSED_POINTS][4], pulls[DRESSED_POINTS][8], morph[DRESSED_POINTS][3];
  float joined[DRESSED_POINTS][2], apart[DRESSED_CORNERS][2];
  uint16_t joints[DRESSED_POINTS][8];
  uint32_t apart_corners[DRESSED_CORNERS];
  int32_t materials[DRESSED_CORNERS];
  uint32_t groups[DRESSED_CORNERS], smoothing[DRESSED_CORNERS];
  const float *morphs[1];
  float corner_values[DRESSED_CORNERS][3], labels[DRESSED_CORNERS];
  uint32_t label_corners[DRESSED_CORNERS];
  tw_attribute attributes[4];
} dressed;

static inline double weight_at(const float *p) {
  return (double)p[0] + 2 * (double)p[1] + 3 * (double)p[2];
}

static inline double share_at(const float *p) {
  return 0.5 + 0.1 * (double)p[0] + 0.2 * (double)p[1] + 0.1 * (double)p[2];
}

/* Adds data to a mesh with coordinates within -1 to 1. The first UV set has one value a point, the second one
 * value a corner: all its edges are seams, as its values grow by 10 with each face. So do the values of an
 * attribute of corners. A face's material, groups and smoothing are its index, and its label is 7 times that.
 */
static inline void dress(tw_mesh *mesh, dressed *d) {
  assert_true(mesh->point_count <= DRESSED_POINTS && mesh->corner_count <= DRESSED_CORNERS);
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    const float *at = point_of(mesh, p);
    d->weight[p] = (float)weight_at(at);
    for (int i = 0; i < 4; i++) d->color[p][i] = i < 3 ? at[i] : 1;
    for (int i = 0; i < 3; i++) d->morph[p][i] = at[(i + 1) % 3];
    uint32_t own = p % 2 ? 1 : 5; /* the joint that is looked for, in the first or the second set */
    d->joints[p][own] = 3;
    d->joints[p][6 - own] = 7;
    d->pulls[p][own] = (float)share_at(at);
    d->pulls[p][6 - own] = (float)(1 - share_at(at));
    memcpy(d->joined[p], at, sizeof d->joined[p]);
  }
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    d->materials[f] = (int32_t)f;
    d->groups[f] = d->smoothing[f] = f;
    d->labels[f] = 7 * (float)f;
    for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; c++) {
      d->apart_corners[c] = c;
      d->apart[c][0] = point_of(mesh, mesh->corners[c])[1] + 10 * (float)f;
      d->apart[c][1] = point_of(mesh, mesh->corners[c])[2];
      d->corner_values[c][0] = point_of(mesh, mesh->corners[c])[0] - 10 * (float)f;
      d->corner_values[c][1] = d->apart[c][0];
      d->corner_values[c][2] = d->apart[c][1];
      d->label_corners[c] = f;
    }
  }
  d->attributes[0] = (tw_attribute){.name = "_WEIGHT", .width = 1, .values = d->weight};
  d->attributes[1] = (tw_attribute){.name = "COLOR_0", .width = 4, .is_color = true, .values = d->color[0]};
  d->attributes[2] = (tw_attribute){.name = "_APART",
                                    .width = 3,
                                    .values = d->corner_values[0],
                                    .value_count = mesh->corner_count,
                                    .corners = d->apart_corners};
  d->attributes[3] = (tw_attribute){.name = "_LABEL",
                                    .width = 1,
                                    .values = d->labels,
                                    .value_count = mesh->face_count,
                                    .corners = d->label_corners,
                                    .numbers = TW_NUMBERS_UINT8};
  d->morphs[0] = d->morph[0];
  mesh->attribute_count = 4;
  mesh->attributes = d->attributes;
  mesh->skin = (tw_skin_weights){.width = 8, .joints = d->joints[0], .weights = d->pulls[0]};
  mesh->morph_count = 1;
  mesh->morphs = d->morphs;
  mesh->uv_set_count = 2;
  mesh->uv_sets[0] = (tw_uv_set){mesh->point_count, d->joined[0], mesh->corners};
  mesh->uv_sets[1] = (tw_uv_set){mesh->corner_count, d->apart[0], d->apart_corners};
  mesh->face_materials = d->materials;
  mesh->face_groups = d->groups;
  mesh->face_smoothing = d->smoothing;
}

static inline void assert_near(double a, double b) {
  if (!(fabs(a - b) < 1e-5)) print_error("%g is not %g\n", a, b);
  assert_true(fabs(a - b) < 1e-5);
}

static inline tw_mesh dressed_cube(dressed *d) {
  tw_mesh mesh = cube();
  *d = (dressed){0};
  dress(&mesh, d);
  return mesh;
}

/* Asserts that a dressed mesh still has the right values everywhere after edits that cut it without moving
 * its surface. */
static inline void assert_dressed(const tw_mesh *mesh) {
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    const float *at = point_of(mesh, p);
    double sum = 0;
    assert_near((double)mesh->attributes[0].values[p], weight_at(at));
    for (uint32_t i = 0; i < 3; i++) {
      assert_near((double)mesh->attributes[1].values[4 * p + i], (double)at[i]);
      assert_near((double)mesh->morphs[0][3 * p + i], (double)at[(i + 1) % 3]);
    }
    for (uint32_t i = 8 * p; i < 8 * p + 8; i++)
      if (mesh->skin.joints[i] == 3) sum += (double)mesh->skin.weights[i];
    assert_near(sum, share_at(at));
  }
  for (uint32_t f = 0; f < mesh->face_count; f++) {
    int32_t parent = mesh->face_materials[f];
    assert_int_equal(mesh->face_groups[f], parent);
    assert_int_equal(mesh->face_smoothing[f], parent);
    for (uint32_t c = mesh->face_offsets[f]; c < mesh->face_offsets[f + 1]; c++) {
      const float *at = point_of(mesh, mesh->corners[c]);
      const float *joined = mesh->uv_sets[0].values + 2 * mesh->uv_sets[0].corners[c];
      const float *apart = mesh->uv_sets[1].values + 2 * mesh->uv_sets[1].corners[c];
      assert_near((double)joined[0], (double)at[0]);
      assert_near((double)joined[1], (double)at[1]);
      assert_near((double)apart[0], (double)at[1] + 10 * parent);
      assert_near((double)apart[1], (double)at[2]);
      const float *own = mesh->attributes[2].values + 3 * mesh->attributes[2].corners[c];
      assert_near((double)own[0], (double)at[0] - 10 * parent);
      assert_near((double)own[1], (double)apart[0]);
      assert_near((double)own[2], (double)apart[1]);
      assert_true(mesh->attributes[3].values[mesh->attributes[3].corners[c]] == 7 * (float)parent);
    }
  }
}

/* A grid of a by b quads in the plane z = 0, with points at integer x and y. */
enum { GRID_MOST = 16 };
typedef struct grid_mesh {
  float points[(GRID_MOST + 1) * (GRID_MOST + 1)][3];
  uint32_t corners[4 * GRID_MOST * GRID_MOST], offsets[GRID_MOST * GRID_MOST + 1];
} grid_mesh;

static inline tw_mesh grid_of(grid_mesh *g, uint32_t a, uint32_t b) {
  for (uint32_t i = 0; i < (a + 1) * (b + 1); i++) {
    g->points[i][0] = (float)(i % (a + 1));
    g->points[i][1] = (float)(i / (a + 1));
    g->points[i][2] = 0;
  }
  for (uint32_t i = 0; i < a * b; i++) {
    uint32_t p = i / a * (a + 1) + i % a;
    const uint32_t quad[4] = {p, p + 1, p + a + 2, p + a + 1};
    memcpy(g->corners + 4 * i, quad, sizeof quad);
    g->offsets[i + 1] = 4 * i + 4;
  }
  g->offsets[0] = 0;
  return mesh_of(g->points[0], (a + 1) * (b + 1), g->corners, g->offsets, a * b);
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
