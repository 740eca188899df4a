/* Limits and normals at levels that no patch covers: three ways lead there, by the level above, by the mask
 * of a valence, by the mask of the vertex. */
#include <math.h>
#include <string.h>

#include "surface_rows.h"

enum { SIDES_MAX = 20, POINTS_MAX = 2 * SIDES_MAX + 2, CORNERS_MAX = 10 * SIDES_MAX };

/* A drum: two ends of `sides` corners, each in one face or in triangles round a point, and quads between. */
static tw_mesh drum(uint32_t sides, bool fans) {
  static float points[POINTS_MAX][3];
  static uint32_t corners[CORNERS_MAX], offsets[3 * SIDES_MAX + 3];
  tw_mesh mesh;
  tw_mesh_init(&mesh);
  for (uint32_t i = 0; i < 2 * sides + 2; i++) {
    bool top = i % 2 == 1, tip = i >= 2 * sides;
    float angle = 6.2831853f * (float)(i / 2) / (float)sides, radius = tip ? 0 : 1 + 0.2f * sinf(3 * angle);
    points[i][0] = radius * cosf(angle);
    points[i][1] = radius * sinf(angle);
    points[i][2] = (top ? 1.0f : -1.0f) + 0.3f * cosf(2 * angle);
  }
  uint32_t *corner = corners;
  for (uint32_t i = 0; i < sides; i++) {
    uint32_t next = (i + 1) % sides, quad[4] = {2 * i, 2 * next, 2 * next + 1, 2 * i + 1};
    memcpy(corner, quad, sizeof quad);
    corner += 4;
    offsets[++mesh.face_count] = (uint32_t)(corner - corners);
  }
  for (uint32_t end = 0; end < 2; end++)
    for (uint32_t i = 0; i < sides; i++) {
      uint32_t next = (i + 1) % sides, at = end ? i : sides - 1 - i;
      *corner++ = 2 * at + end;
      if (fans) {
        *corner++ = 2 * (end ? next : (at + sides - 1) % sides) + end;
        *corner++ = 2 * sides + end;
      }
      if (fans || i + 1 == sides) offsets[++mesh.face_count] = (uint32_t)(corner - corners);
    }
  mesh.point_count = 2 * sides + (fans ? 2 : 0);
  mesh.positions = points[0];
  mesh.corners = corners;
  mesh.corner_count = (uint32_t)(corner - corners);
  mesh.face_offsets = offsets;
  return mesh;
}

static void agree(const rows *a, const rows *b) {
  assert_int_equal(a->count, b->count);
  for (size_t i = 0; i < a->count; i++)
    for (uint32_t c = 0; c < 3; c++) {
      assert_true(fabsf(row_of(a, i)[c] - row_of(b, i)[c]) < 1e-6f);
      if (a->layout->normal != UINT32_MAX)
        assert_true(fabsf(row_of(a, i)[a->layout->normal + c] - row_of(b, i)[b->layout->normal + c]) < 5e-6f);
    }
}

/* Colours ask for the level's own connectivity; after a crease, of next to no sharpness, it is looked at
 * vertex by vertex. */
TEST(all_ways_give_the_same_rows) {
  static float colors[POINTS_MAX][4];
  static const uint32_t crease[2] = {0, 2};
  static const float sharpness[1] = {1e-6f};
  static const uint32_t sides[] = {3, 4, 5, 16, 17};
  for (size_t n = 0; n < sizeof sides / sizeof *sides; n++)
    for (int flags = 1; flags < 16; flags++) {
      tw_surface_options options = {.level = flags & 8 ? 2 : 1, .limit = flags & 1, .normals = flags & 2};
      if (!options.limit && !options.normals) continue;
      if (sides[n] == 4 && !(flags & 4)) continue; /* a cage of quads, which patches may cover */
      tw_mesh mesh = drum(sides[n], flags & 4), colored = mesh, creased = mesh;
      colored.colors = colors[0];
      creased.crease_count = 1;
      creased.crease_edges = crease;
      creased.crease_sharpness = sharpness;
      rows above = read_rows(&mesh, options), own = read_rows(&colored, options),
           searched = read_rows(&creased, options);
      agree(&above, &own);
      agree(&above, &searched);
      free_rows(&above);
      free_rows(&own);
      free_rows(&searched);
    }
}

/* The limit of a cage's vertex is the same from whichever level it is taken. */
TEST(limits_do_not_depend_on_the_level) {
  tw_mesh mesh = drum(5, true);
  rows shallow = read_rows(&mesh, (tw_surface_options){.level = 1, .limit = true, .normals = true});
  for (uint32_t level = 2; level <= 5; level++) {
    rows deep = read_rows(&mesh, (tw_surface_options){.level = level, .limit = true, .normals = true});
    for (size_t i = 0; i < mesh.point_count; i++)
      for (uint32_t c = 0; c < 6; c++)
        assert_true(fabsf(row_of(&shallow, i)[c] - row_of(&deep, i)[c]) < 1e-5f);
    free_rows(&deep);
  }
  free_rows(&shallow);
}
