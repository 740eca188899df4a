/* STL and PLY answers, and points. */
#include <math.h>

#include "scene_fixture.h"
#include "wrapped_memory.h"

enum { FORMS = 3 };
static const tw_flat_options forms[FORMS] = {
    {.form = TW_FLAT_STL, .scale = 1000, .unit = "mm"},
    {.form = TW_FLAT_PLY, .scale = 1, .unit = "m"},
    {.form = TW_FLAT_POINTS, .scale = 1, .has_normals = true, .has_uvs = true}};

static tw_flat_stream *open_flat(const tw_scene *scene, const tw_flat_options *options) {
  tw_flat_stream *stream = NULL;
  tw_error error;
  if (tw_flat_stream_create(scene, options, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  return stream;
}

/* The whole file, read in blocks. Freed by the caller. */
static uint8_t *write_flat(const tw_scene *scene, const tw_flat_options *options, size_t block,
                           size_t *size) {
  tw_flat_stream *stream = open_flat(scene, options);
  size_t got = 0, count;
  *size = (size_t)tw_flat_stream_size(stream);
  uint8_t *bytes = malloc(*size + block);
  assert_non_null(bytes);
  while ((count = tw_flat_stream_read(stream, bytes + got, block)) > 0) got += count;
  assert_int_equal(got, *size);
  tw_flat_stream_destroy(stream);
  return bytes;
}

TEST(model_without_meshes_is_an_empty_file) {
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  for (int i = 0; i < 2; i++) {
    size_t size;
    uint8_t *bytes = write_flat(&f.scene, &forms[i], 100, &size);
    if (i == 0) assert_int_equal(size, 84);
    if (i == 1) assert_non_null(strstr((char *)bytes, "element vertex 0\n"));
    free(bytes);
  }
  fixture_deinit(&f);
}

TEST(same_bytes_in_blocks_of_any_size_and_from_any_offset) {
  static const size_t blocks[] = {1, 7, 4096, 65537};
  for (uint32_t level = 0; level < 4; level += 3)
    for (int i = 0; i < 2 * FORMS; i++) {
      const tw_flat_options *options = &forms[i % FORMS];
      fixture f;
      size_t size, again;
      fixture_init(&f, patchwork_text);
      fixture_refine(&f, level, true);
      if (i >= FORMS) f.scene.polygons = TW_POLYGONS_NGON;
      uint8_t *whole = write_flat(&f.scene, options, 1 << 20, &size), part[300];
      for (size_t b = 0; b < sizeof blocks / sizeof *blocks; b++) {
        uint8_t *parts = write_flat(&f.scene, options, blocks[b], &again);
        assert_int_equal(again, size);
        assert_memory_equal(parts, whole, size);
        free(parts);
      }
      tw_flat_stream *stream = open_flat(&f.scene, options);
      for (size_t offset = size; offset > 0; offset -= offset > 251 ? 251 : offset) { /* from the end back */
        tw_flat_stream_seek(stream, offset);
        size_t count = tw_flat_stream_read(stream, part, sizeof part);
        assert_int_equal(count, size - offset < sizeof part ? size - offset : sizeof part);
        assert_memory_equal(part, whole + offset, count);
      }
      tw_flat_stream_destroy(stream);
      free(whole);
      fixture_deinit(&f);
    }
}

/* Triangles with the same points in the same order, compared with the surface's own. */
TEST(facets_have_the_points_of_the_surface_bit_for_bit) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 3, true);
  size_t size;
  const tw_flat_options metres = {.form = TW_FLAT_STL, .scale = 1, .unit = "m"};
  uint8_t *bytes = write_flat(&f.scene, &metres, 1 << 20, &size);
  const tw_surface *surface = f.scene.surfaces[0];
  uint32_t faces = (uint32_t)tw_surface_get_counts(surface)->faces,
           points = (uint32_t)tw_surface_get_counts(surface)->vertices;
  assert_int_equal(size, 84 + 50 * 2 * faces);
  float *rows = malloc(points * 3 * sizeof *rows);
  uint32_t *corners = malloc(faces * 4 * sizeof *corners);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  assert_true(rows && corners && reader);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, points, rows);
  tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, faces, NULL, corners);
  for (uint32_t t = 0; t < 2 * faces; t++) {
    static const uint32_t halves[2][3] = {{0, 1, 2}, {0, 2, 3}};
    for (int k = 0; k < 3; k++) {
      const float *point = rows + 3 * (size_t)corners[4 * (t / 2) + halves[t % 2][k]];
      assert_memory_equal(bytes + 84 + 50 * (size_t)t + 12 * (size_t)(1 + k), point, 12);
    }
  }
  tw_surface_reader_destroy(reader);
  free(corners);
  free(rows);
  free(bytes);
  fixture_deinit(&f);
}

TEST(points_are_rows_of_the_surface) {
  for (uint32_t level = 0; level < 4; level++) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    const tw_surface *surface = f.scene.surfaces[0];
    uint32_t points = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_POINTS), length;
    tw_surface_reader *reader = tw_surface_reader_create(surface);
    float *rows = malloc(points * 8 * sizeof *rows), *own = malloc(points * 8 * sizeof *own);
    assert_true(reader && rows && own);
    tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, points, rows);
    tw_surface_reader_turn_to_unsplit(reader, surface, &(tw_point_columns){true, true, UINT32_MAX});
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, points, own);
    for (int i = 0; i < 2; i++) {
      const tw_flat_options options = {.form = TW_FLAT_POINTS, .scale = 1, .has_normals = i, .has_uvs = i};
      size_t size, row = i ? 8 : 3;
      uint8_t *bytes = write_flat(&f.scene, &options, 1000, &size);
      memcpy(&length, bytes + 8, sizeof length);
      assert_memory_equal(bytes, "TWSB\1\0\0\0", 8);
      assert_int_equal(size, 12 + length + points * row * sizeof(float));
      for (uint32_t p = 0; p < points; p++) {
        float got[8];
        memcpy(got, bytes + 12 + length + p * row * sizeof *got, row * sizeof *got);
        for (uint32_t c = 0; c < 3; c++) assert_true(got[c] == rows[3 * p + c]);
        for (size_t c = 3; c < row; c++) assert_true(fabsf(got[c] - own[8 * p + c]) < 1e-6f);
      }
      free(bytes);
    }
    tw_surface_reader_destroy(reader);
    free(own);
    free(rows);
    fixture_deinit(&f);
  }
}

/* Whether a row of 8 floats has the same point, and else the same values up to rounding: a normal may be
 * computed from another of the faces that share it. */
static bool is_same_row(const float *a, const float *b) {
  if (memcmp(a, b, 3 * sizeof *a) != 0) return false;
  for (int c = 3; c < 8; c++)
    if (fabsf(a[c] - b[c]) > 1e-5f) return false;
  return true;
}

/* Rows of points have the values of one of the rows that a point is split into. */
TEST(unsplit_rows_are_among_the_split_ones) {
  for (uint32_t level = 0; level < 5; level++) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    const tw_surface *surface = f.scene.surfaces[0];
    tw_surface_reader *reader = tw_surface_reader_create(surface);
    uint32_t points = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_POINTS),
             vertices = (uint32_t)tw_surface_row_count(surface, TW_DOMAIN_VERTICES), found = 0;
    uint32_t stride = tw_surface_get_layout(surface)->stride;
    float *split = malloc(vertices * stride * sizeof *split), *own = malloc(points * 8 * sizeof *own);
    assert_true(reader && split && own && vertices > points && stride == 8);
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, vertices, split);
    tw_surface_reader_turn_to_unsplit(reader, surface, &(tw_point_columns){true, true, UINT32_MAX});
    assert_int_equal(tw_surface_reader_layout(reader)->stride, stride);
    tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, 0, points, own);
    for (uint32_t p = 0; p < points; p++) {
      uint32_t v = 0;
      while (v < vertices && !is_same_row(own + 8 * (size_t)p, split + 8 * (size_t)v)) v++;
      found += v < vertices;
    }
    assert_int_equal(found, points);
    tw_surface_reader_destroy(reader);
    free(split);
    free(own);
    fixture_deinit(&f);
  }
}

/* A node below another: together they scale by nearly as much as a float holds. */
TEST(coordinates_beyond_floats_are_refused) {
  fixture f;
  fixture_init(&f, cube_text);
  uint32_t inner = fixture_node(&f, "inner", 0, 0);
  f.model->nodes[0].mesh = TW_NO_INDEX;
  for (int c = 0; c < 3; c++) f.model->nodes[0].rest.scale[c] = f.model->nodes[inner].rest.scale[c] = 1.5e19f;
  fixture_refine(&f, 1, true);
  tw_flat_stream *stream;
  tw_error error;
  size_t size;
  free(write_flat(&f.scene, &forms[1], 4096, &size)); /* 2.25e38 metres */
  assert_int_equal(tw_flat_stream_create(&f.scene, &forms[0], &stream, &error), TW_LIMIT);
  const tw_3mf_options options = {.scale = 1000, .unit = "millimeter"};
  tw_3mf_stream *package;
  assert_int_equal(tw_3mf_stream_create(&f.scene, &options, &package, &error), TW_LIMIT);
  f.model->nodes[inner].rest.scale[0] = 1e20f; /* the matrix itself is beyond floats */
  f.model->nodes[0].rest.scale[0] = 1e20f;
  assert_int_equal(tw_flat_stream_create(&f.scene, &forms[1], &stream, &error), TW_LIMIT);
  assert_string_equal(error.detail, "nodes and units take coordinates beyond 3.4e38");
  tw_obj_stream *text;
  assert_int_equal(tw_obj_stream_create(&f.scene, &text, &error), TW_LIMIT);
  fixture_deinit(&f);
}

TEST(without_memory_there_is_no_stream) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 2, true);
  for (int i = 0; i < FORMS; i++) {
    tw_status status = TW_NO_MEMORY;
    for (size_t failures = 0; status != TW_OK; failures++) {
      tw_flat_stream *stream = NULL;
      test_memory.left = failures;
      status = tw_flat_stream_create(&f.scene, &forms[i], &stream, NULL);
      test_memory.left = SIZE_MAX;
      assert_true(status == TW_OK ? stream && failures > 10 : status == TW_NO_MEMORY && !stream);
      tw_flat_stream_destroy(stream);
    }
  }
  fixture_deinit(&f);
}
