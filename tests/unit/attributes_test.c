/* What goes along on a surface: colours, morph targets, material groups. */
#include <math.h>

#include "scene_fixture.h"
#include "surface_rows.h"
#include "test.h"

/* ---- colours --------------------------------------------------------------------------------- */

TEST(colours_never_leave_their_range) {
  fixture f;
  fixture_init(&f, patchwork_text);
  tw_mesh *mesh = &f.model->meshes[0];
  float *colors = fixture_alloc(&f, mesh->point_count, 4 * sizeof *colors);
  for (uint32_t i = 0; i < 4 * mesh->point_count; i++) colors[i] = i % 4 == 0 ? -0.5f : i % 4 == 1 ? 1.5f : 1;
  assert_int_equal(tw_mesh_set_colors(mesh, colors, f.model->arena), TW_OK);
  for (uint32_t level = 0; level <= 4; level++)
    for (int limit = 0; limit < 2; limit++) {
      rows r = read_rows(mesh, (tw_surface_options){.level = level, .limit = limit});
      for (size_t i = 0; i < r.count; i++) {
        const float *color = row_of(&r, i) + r.layout->attributes[0].column;
        assert_true(color[0] == 0 && color[1] == 1 && color[2] <= 1 && color[2] > 0.999999f && color[3] <= 1);
      }
      free_rows(&r);
    }
  fixture_deinit(&f);
}

TEST(colours_that_follow_the_points_stay_with_them) {
  fixture f;
  fixture_init(&f, patchwork_text);
  tw_mesh *mesh = &f.model->meshes[0];
  float *colors = fixture_alloc(&f, mesh->point_count, 4 * sizeof *colors);
  for (uint32_t p = 0; p < mesh->point_count; p++)
    for (int c = 0; c < 4; c++)
      colors[4 * p + (uint32_t)c] = c < 3 ? mesh->positions[3 * p + (uint32_t)c] / 8 + 0.25f : 0.5f;
  assert_int_equal(tw_mesh_set_colors(mesh, colors, f.model->arena), TW_OK);
  for (uint32_t level = 0; level <= 4; level++) {
    rows r = read_rows(mesh, (tw_surface_options){.level = level, .normals = true});
    for (size_t i = 0; i < r.count; i++) {
      const float *color = row_of(&r, i) + r.layout->attributes[0].column;
      for (int c = 0; c < 3; c++) assert_float_equal(color[c], row_of(&r, i)[c] / 8 + 0.25f, 1e-6);
      assert_float_equal(color[3], 0.5f, 1e-6);
    }
    free_rows(&r);
  }
  fixture_deinit(&f);
}

/* ---- attributes of an application's own ------------------------------------------------------ */

/* Functions of the point: subdivision keeps linear ones. */
static float at_point(const float *point, uint32_t column) {
  return 5 * point[column % 3] - 2 * point[(column + 1) % 3] + (float)column;
}

/* One to four components each, at seams, creases and borders, by every way that rows are made. */
TEST(attributes_follow_the_points_as_they_are) {
  fixture f;
  fixture_init(&f, patchwork_text);
  tw_mesh *mesh = &f.model->meshes[0];
  static const uint32_t edges[4] = {1, 5, 5, 6};
  static const float sharpness[2] = {10, 1.5f};
  mesh->crease_count = 2;
  mesh->crease_edges = edges;
  mesh->crease_sharpness = sharpness;
  tw_attribute attributes[4];
  for (uint32_t a = 0; a < 4; a++) {
    float *values = fixture_alloc(&f, mesh->point_count, (a + 1) * sizeof *values);
    for (uint32_t i = 0; i < (a + 1) * mesh->point_count; i++)
      values[i] = at_point(mesh->positions + 3 * (size_t)(i / (a + 1)), a + i % (a + 1));
    attributes[a] = (tw_attribute){.name = "_A", .width = a + 1, .values = values};
  }
  mesh->attributes = attributes;
  mesh->attribute_count = 4;
  for (uint32_t level = 0; level <= 5; level++)
    for (int limit = 0; limit < 2; limit++)
      for (int scheme = 0; scheme < 2; scheme++) {
        static const tw_scheme schemes[] = {TW_CATMULL_CLARK, TW_BILINEAR};
        rows r = read_rows(mesh, (tw_surface_options){.level = level,
                                                      .scheme = schemes[scheme],
                                                      .boundary = TW_BOUNDARY_EDGE_ONLY,
                                                      .limit = limit,
                                                      .normals = true});
        assert_int_equal(r.layout->attribute_count, 4);
        for (size_t i = 0; i < r.count; i++)
          for (uint32_t a = 0; a < 4; a++)
            for (uint32_t c = 0; c <= a; c++)
              assert_float_equal(row_of(&r, i)[r.layout->attributes[a].column + c],
                                 at_point(row_of(&r, i), a + c), 2e-5);
        free_rows(&r);
      }
  fixture_deinit(&f);
}

/* ---- morph targets --------------------------------------------------------------------------- */

/* Subdivision is linear: the surface of the moved cage is the surface moved by the displacements. */
TEST(displacements_move_the_surface_as_they_move_the_cage) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_morphs(&f, 3);
  tw_mesh *mesh = &f.model->meshes[0];
  float *moved = fixture_alloc(&f, mesh->point_count, 3 * sizeof *moved);
  static const float weights[3] = {0.5f, -1, 2};
  for (uint32_t i = 0; i < 3 * mesh->point_count; i++) {
    moved[i] = mesh->positions[i];
    for (int m = 0; m < 3; m++) moved[i] += weights[m] * mesh->morphs[m][i];
  }
  tw_mesh other = *mesh;
  other.positions = moved;
  for (uint32_t level = 0; level <= 4; level++)
    for (int limit = 0; limit < 2; limit++) {
      tw_surface_options options = {.level = level, .limit = limit, .normals = true};
      rows a = read_rows(mesh, options), b = read_rows(&other, options);
      assert_int_equal(a.layout->morph_count, 3);
      assert_int_equal(a.count, b.count);
      for (size_t i = 0; i < a.count; i++)
        for (uint32_t c = 0; c < 3; c++) {
          double sum = (double)row_of(&a, i)[c];
          for (uint32_t m = 0; m < 3; m++)
            sum += (double)weights[m] * (double)row_of(&a, i)[a.layout->morphs + 3 * m + c];
          assert_float_equal(row_of(&b, i)[c], sum, 1e-5);
        }
      free_rows(&a);
      free_rows(&b);
    }
  fixture_deinit(&f);
}

static void assert_normals_displaced(const tw_mesh *mesh, tw_surface_options options) {
  rows a = read_rows(mesh, options);
  assert_int_equal(a.layout->morph_width, 6);
  for (uint32_t m = 0; m < mesh->morph_count; m++) {
    float *moved = malloc(3 * mesh->point_count * sizeof *moved);
    assert_non_null(moved);
    for (uint32_t i = 0; i < 3 * mesh->point_count; i++) moved[i] = mesh->positions[i] + mesh->morphs[m][i];
    tw_mesh other = *mesh;
    other.positions = moved;
    other.morph_normals = NULL;
    rows b = read_rows(&other, options);
    assert_int_equal(b.layout->morph_width, 3);
    assert_int_equal(a.count, b.count);
    for (size_t i = 0; i < a.count; i++)
      for (uint32_t c = 0; c < 3; c++) {
        float displaced = row_of(&a, i)[a.layout->morphs + 6 * m + 3 + c];
        assert_float_equal(displaced,
                           row_of(&b, i)[b.layout->normal + c] - row_of(&a, i)[a.layout->normal + c], 0);
      }
    free_rows(&b);
    free(moved);
  }
  free_rows(&a);
}

/* To the last bit, by every way that rows are made. */
TEST(normals_are_displaced_to_those_of_the_moved_surface) {
  static const uint32_t edges[4] = {1, 5, 5, 6};
  static const float sharpness[2] = {10, 1.5f};
  static const tw_scheme schemes[] = {TW_CATMULL_CLARK, TW_BILINEAR, TW_LOOP};
  for (int scheme = 0; scheme < 3; scheme++) {
    fixture f;
    fixture_init(&f, schemes[scheme] == TW_LOOP ? "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                  "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
                                                : patchwork_text);
    fixture_add_morphs(&f, 3);
    fixture_add_morph_normals(&f);
    tw_mesh *mesh = &f.model->meshes[0];
    if (schemes[scheme] != TW_LOOP) {
      mesh->crease_count = 2;
      mesh->crease_edges = edges;
      mesh->crease_sharpness = sharpness;
    }
    for (uint32_t level = 0; level <= 5; level++)
      for (int limit = 0; limit < 2; limit++)
        assert_normals_displaced(mesh, (tw_surface_options){.level = level,
                                                            .scheme = schemes[scheme],
                                                            .limit = limit,
                                                            .normals = true,
                                                            .own_normals = level > 0});
    fixture_deinit(&f);
  }
}

TEST(normals_are_displaced_alike_in_any_part_of_the_rows) {
  enum { TARGETS = 5 };
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_colors(&f);
  fixture_add_morphs(&f, TARGETS);
  fixture_add_morph_normals(&f);
  for (uint32_t level = 0; level <= 6; level += 3)
    for (int own = 0; own < 2; own++) {
      rows r = read_rows(&f.model->meshes[0],
                         (tw_surface_options){.level = level, .normals = true, .own_normals = own});
      const tw_surface *surface = r.surface;
      tw_surface_reader *reader = tw_surface_reader_create_shared(&surface, 1, 4);
      assert_non_null(reader);
      for (uint32_t first = 0; first + 2 <= TARGETS; first++) {
        tw_surface_reader_turn(reader, r.surface, first, 2);
        const tw_surface_layout *layout = tw_surface_reader_layout(reader);
        assert_int_equal(layout->stride, 18);
        for (size_t i = first; i < r.count; i += 7) {
          float row[7 * 18];
          size_t count = r.count - i < 7 ? r.count - i : 7;
          tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, i, count, row);
          for (size_t k = 0; k < count; k++)
            assert_memory_equal(row + k * 18 + layout->morphs,
                                row_of(&r, i + k) + r.layout->morphs + 6 * (size_t)first, 12 * sizeof *row);
        }
      }
      tw_surface_reader_destroy(reader);
      free_rows(&r);
    }
  fixture_deinit(&f);
}

TEST(level_0_with_normals_of_the_file_has_its_displacements_too) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_morphs(&f, 2);
  fixture_add_morph_normals(&f);
  tw_mesh *mesh = &f.model->meshes[0];
  rows r = read_rows(mesh, (tw_surface_options){.normals = true, .own_normals = true});
  tw_surface_reader *reader = tw_surface_reader_create(r.surface);
  uint32_t faces[24];
  tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, 0, 6, NULL, faces);
  for (uint32_t c = 0; c < mesh->corner_count; c++)
    for (uint32_t m = 0; m < 2; m++)
      assert_memory_equal(row_of(&r, faces[c]) + r.layout->morphs + 6 * m + 3, mesh->morph_normals[m] + 3 * c,
                          3 * sizeof(float));
  assert_true(r.count > 8); /* one normal, but not the same displacements of it */
  tw_surface_reader_destroy(reader);
  free_rows(&r);
  fixture_deinit(&f);
}

TEST(without_normals_nothing_displaces_them) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_add_morphs(&f, 2);
  fixture_add_morph_normals(&f);
  const tw_surface_options cases[] = {{.level = 2}, {.level = 2, .normals = true, .movable = true}};
  for (int i = 0; i < 2; i++) {
    rows r = read_rows(&f.model->meshes[0], cases[i]);
    assert_int_equal(r.layout->morph_width, 3);
    free_rows(&r);
  }
  fixture_deinit(&f);
}

TEST(bounds_of_displacements_are_exact) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_add_morphs(&f, 2);
  fixture_add_morph_normals(&f);
  rows r = read_rows(&f.model->meshes[0], (tw_surface_options){.level = 3, .normals = true});
  for (int m = 0; m < 2; m++) {
    float bounds[2][3], min[3], max[3];
    for (size_t i = 0; i < r.count; i++)
      for (int c = 0; c < 3; c++) {
        float value = (row_of(&r, i) + r.layout->morphs + 6 * m)[c];
        if (i == 0 || value < bounds[0][c]) bounds[0][c] = value;
        if (i == 0 || value > bounds[1][c]) bounds[1][c] = value;
      }
    assert_int_equal(tw_surface_bounds(r.surface, m, min, max), TW_OK);
    assert_memory_equal(min, bounds[0], sizeof min);
    assert_memory_equal(max, bounds[1], sizeof max);
  }
  free_rows(&r);
  fixture_deinit(&f);
}

/* ---- materials ------------------------------------------------------------------------------- */

static void groups_hold_the_faces_of_each_material(tw_mesh *mesh) {
  for (uint32_t level = 0; level <= 3; level++) {
    rows r = read_rows(mesh, (tw_surface_options){.level = level});
    assert_int_equal(tw_surface_group_count(r.surface), 3);
    uint64_t face = 0, corner = 0;
    for (uint32_t g = 0; g < 3; g++) {
      const tw_surface_group *group = tw_surface_get_group(r.surface, g);
      uint64_t faces = 0, corners = 0;
      for (uint32_t i = 0; i < mesh->face_count; i++) {
        uint32_t size = mesh->face_offsets[i + 1] - mesh->face_offsets[i];
        if (mesh->face_materials[i] != group->material) continue;
        faces += level == 0 ? 1 : (uint64_t)size << 2 * (level - 1);
        corners += level == 0 ? size : (uint64_t)size << 2 * level;
      }
      assert_int_equal(group->first_face, face);
      assert_int_equal(group->first_corner, corner);
      assert_int_equal(group->face_count, faces);
      assert_int_equal(group->corner_count, corners);
      face += faces;
      corner += corners;
    }
    assert_int_equal(face, tw_surface_get_counts(r.surface)->faces);
    free_rows(&r);
  }
}

TEST(faces_of_each_material_lie_next_to_each_other) {
  static const int32_t in_order[] = {0, 0, 1, 1, 1, 2, 2};
  fixture f;
  fixture_init(&f, patchwork_text);
  tw_mesh *mesh = &f.model->meshes[0];
  groups_hold_the_faces_of_each_material(mesh);
  mesh->face_materials = in_order;
  groups_hold_the_faces_of_each_material(mesh);
  fixture_deinit(&f);
}
