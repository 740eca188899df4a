/* A surface is the same whatever its memory held before. */
#include <malloc.h>
#include <math.h>
#include <string.h>

#include "surface_rows.h"

enum { SIDE = 40, POINTS = (SIDE + 1) * (SIDE + 1) + 1 };

typedef struct sheet {
  tw_mesh mesh;
  float points[POINTS][3];
  uint32_t corners[6 * SIDE * SIDE + 3], offsets[2 * SIDE * SIDE + 2];
  uint32_t creases[SIDE][2];
  float sharpness[SIDE];
} sheet;

static void add_face(sheet *s, uint32_t size, const uint32_t *points) {
  memcpy(s->corners + s->mesh.corner_count, points, size * sizeof *points);
  s->mesh.corner_count += size;
  s->offsets[++s->mesh.face_count] = s->mesh.corner_count;
}

/* Of quads and triangles; kind 1: of triangles, 2: of quads. fin: an edge has three faces. */
static void make_sheet(sheet *s, int kind, bool fin) {
  memset(s, 0, sizeof *s);
  tw_mesh_init(&s->mesh);
  for (uint32_t i = 0; i < POINTS; i++) {
    float x = (float)(i % (SIDE + 1)), y = (float)(i / (SIDE + 1)); /* NOLINT(bugprone-integer-division) */
    memcpy(s->points[i], (float[]){x, y, sinf(0.3f * x) * cosf(0.2f * y)}, sizeof s->points[i]);
  }
  for (uint32_t i = 0; i < SIDE * SIDE; i++) {
    uint32_t a = i / SIDE * (SIDE + 1) + i % SIDE, d = a + SIDE + 1;
    if (kind == 2 || (kind == 0 && i % 3 > 0)) {
      add_face(s, 4, (uint32_t[]){a, a + 1, d + 1, d});
      continue;
    }
    add_face(s, 3, (uint32_t[]){a, a + 1, d + 1});
    add_face(s, 3, (uint32_t[]){a, d + 1, d});
  }
  if (fin) add_face(s, 3, (uint32_t[]){0, 1, POINTS - 1});
  for (uint32_t i = 0; i < SIDE; i++) {
    s->creases[i][0] = i * (SIDE + 1) + 7;
    s->creases[i][1] = (i + 1) * (SIDE + 1) + 7;
    s->sharpness[i] = i % 5 == 4 ? TW_SHARPNESS_INFINITE : 0.7f * (float)(1 + i % 4);
  }
  s->mesh.point_count = POINTS;
  s->mesh.positions = s->points[0];
  s->mesh.corners = s->corners;
  s->mesh.face_offsets = s->offsets;
  s->mesh.crease_edges = s->creases[0];
  s->mesh.crease_sharpness = s->sharpness;
}

static void check_dirty(const sheet *s, tw_surface_options options) {
  mallopt(M_PERTURB, 0);
  rows wanted = read_rows(&s->mesh, options), moved = {0};
  for (int byte = 0x5A; byte <= 0xB4; byte += 0x5A) { /* what fresh memory is filled with */
    mallopt(M_PERTURB, byte);
    rows again = read_rows(&s->mesh, options);
    assert_int_equal(again.count, wanted.count);
    assert_memory_equal(again.values, wanted.values,
                        wanted.count * wanted.layout->stride * sizeof *wanted.values);
    assert_int_equal(tw_surface_with_positions(again.surface, s->mesh.positions, &moved.surface), TW_OK);
    tw_surface_reader *reader = tw_surface_reader_create(moved.surface);
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, again.count, again.values);
    assert_memory_equal(again.values, wanted.values,
                        wanted.count * wanted.layout->stride * sizeof *wanted.values);
    tw_surface_reader_destroy(reader);
    tw_surface_destroy(moved.surface);
    free_rows(&again);
  }
  free_rows(&wanted);
}

TEST(surfaces_are_the_same_whatever_memory_they_are_made_in) {
  sheet *s = malloc(sizeof *s);
  assert_non_null(s);
  for (int i = 0; i < 3 * 2 * 2 * 2 * 3; i++) {
    int kind = i % 3, fin = i / 3 % 2, creased = i / 6 % 2, normals = i / 12 % 2;
    make_sheet(s, kind, fin && kind != 2);
    if (creased) s->mesh.crease_count = SIDE;
    tw_surface_options options = {.level = (uint32_t)(i / 24 % 3), .normals = normals, .movable = true};
    check_dirty(s, options);
    options.boundary = TW_BOUNDARY_NONE;
    if (i / 24 == 1) check_dirty(s, options);
    options = (tw_surface_options){.level = (uint32_t)(i / 24 % 3), .movable = true, .scheme = TW_LOOP};
    if (kind == 1 && !normals) check_dirty(s, options);
  }
  free(s);
}
