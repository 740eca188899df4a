/* The model part of 3MF answers. */
#include "scene_fixture.h"
#include "wrapped_memory.h"

static const tw_3mf_options metres = {.scale = 1, .unit = "meter"};

static tw_3mf_stream *open_3mf(const tw_scene *scene, const tw_3mf_options *options) {
  tw_3mf_stream *stream = NULL;
  tw_error error;
  if (tw_3mf_stream_create(scene, options, &stream, &error) != TW_OK) fail_msg("%s", error.detail);
  return stream;
}

/* The whole part, read in blocks, terminated. Freed by the caller. */
static char *write_3mf(const tw_scene *scene, const tw_3mf_options *options, size_t block) {
  tw_3mf_stream *stream = open_3mf(scene, options);
  uint64_t bound = tw_3mf_stream_bound(stream);
  char *text = calloc(bound + block + 1, 1);
  size_t size = 0;
  int64_t count;
  assert_non_null(text);
  while ((count = tw_3mf_stream_read(stream, (uint8_t *)text + size, block)) > 0) {
    size += (size_t)count;
    assert_true(size <= bound);
  }
  assert_int_equal(count, 0);
  tw_3mf_stream_destroy(stream);
  return text;
}

static size_t count_of(const char *text, const char *word) {
  size_t count = 0;
  for (; (text = strstr(text, word)); text++) count++;
  return count;
}

TEST(model_without_meshes_builds_nothing) {
  fixture f = {.model = tw_model_create()};
  assert_non_null(f.model);
  fixture_refine(&f, 1, true);
  char *text = write_3mf(&f.scene, &metres, 100);
  assert_non_null(strstr(text, "</metadata><resources></resources><build></build></model>\n"));
  free(text);
  fixture_deinit(&f);
}

TEST(same_text_in_blocks_of_any_size) {
  static const size_t blocks[] = {1, 7, 4096, 65537};
  for (uint32_t level = 0; level < 4; level += 3) {
    fixture f;
    fixture_init(&f, patchwork_text);
    fixture_refine(&f, level, true);
    char *whole = write_3mf(&f.scene, &metres, 1 << 20);
    for (size_t b = 0; b < sizeof blocks / sizeof *blocks; b++) {
      char *parts = write_3mf(&f.scene, &metres, blocks[b]);
      assert_string_equal(parts, whole);
      free(parts);
    }
    free(whole);
    fixture_deinit(&f);
  }
}

/* The numbers read back as the surface's own bits, and name its faces. */
TEST(vertices_and_triangles_are_the_surface) {
  fixture f;
  fixture_init(&f, cube_text);
  fixture_refine(&f, 3, true);
  const tw_surface *surface = f.scene.surfaces[0];
  uint32_t faces = (uint32_t)tw_surface_get_counts(surface)->faces,
           points = (uint32_t)tw_surface_get_counts(surface)->vertices;
  float *rows = malloc(points * 3 * sizeof *rows);
  uint32_t *corners = malloc(faces * 4 * sizeof *corners);
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  assert_true(rows && corners && reader);
  tw_surface_read_rows(reader, TW_DOMAIN_POINTS, 0, points, rows);
  tw_surface_read_faces(reader, TW_DOMAIN_POINTS, 0, faces, NULL, corners);
  char *text = write_3mf(&f.scene, &metres, 1 << 20), *at = text;
  assert_int_equal(count_of(text, "<vertex "), points);
  assert_int_equal(count_of(text, "<triangle "), 2 * faces);
  for (uint32_t i = 0; i < 3 * points; i++) {
    at = strpbrk(i == 0 ? strstr(text, "<vertex ") : at, "\"") + 1;
    assert_true(strtof(at, &at) == rows[i]);
    at++;
  }
  for (uint32_t t = 0; t < 2 * faces; t++) {
    static const uint32_t halves[2][3] = {{0, 1, 2}, {0, 2, 3}};
    at = strstr(at, "<triangle ");
    for (int k = 0; k < 3; k++) {
      at = strchr(at, '"') + 1;
      assert_int_equal(strtoul(at, &at, 10), corners[4 * (t / 2) + halves[t % 2][k]]);
      at++;
    }
  }
  tw_surface_reader_destroy(reader);
  free(text);
  free(corners);
  free(rows);
  fixture_deinit(&f);
}

/* Plain, mirrored and flat nodes: an object each, and no more for further nodes. */
TEST(nodes_of_a_mesh_share_objects) {
  fixture f;
  fixture_init(&f, cube_text);
  static const float scales[5] = {1, 2, -1, -3, 0};
  for (int i = 0; i < 5; i++) {
    uint32_t node = i == 0 ? 0 : fixture_node(&f, "more", TW_NO_INDEX, 0);
    f.model->nodes[node].rest.scale[0] = scales[i];
  }
  fixture_refine(&f, 1, true);
  char *text = write_3mf(&f.scene, &metres, 1000), *at = strstr(text, "<build>");
  static const char *const objects[5] = {"\"2\"", "\"2\"", "\"3\"", "\"3\"", "\"4\""};
  assert_int_equal(count_of(text, "<object "), 3);
  assert_int_equal(count_of(text, "<item "), 5);
  for (int i = 0; i < 5; i++) {
    at = strstr(at, "objectid=") + strlen("objectid=");
    assert_memory_equal(at, objects[i], 3);
  }
  assert_non_null(strstr(text, "transform=\"3 0 0 0 1 0 0 0 1 0 0 0\"")); /* mirrored twice */
  free(text);
  fixture_deinit(&f);
}

TEST(faces_have_their_materials) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 0, true);
  char *text = write_3mf(&f.scene, &metres, 1000);
  static const char *const names[4] = {"name=\"red\"", "name=\"green\"", "name=\"blue\"", "name=\"none\""};
  for (int i = 0; i < 4; i++) assert_int_equal(count_of(text, names[i]), 1);
  assert_int_equal(count_of(text, "pindex=\"0\""), 1); /* red unless a triangle says otherwise */
  assert_int_equal(count_of(text, "p1=\"1\""), 4);
  assert_int_equal(count_of(text, "p1=\"2\""), 2);
  assert_int_equal(count_of(text, "p1="), 6);
  free(text);
  fixture_deinit(&f);
}

TEST(names_are_escaped) {
  fixture f;
  fixture_init(&f, cube_text);
  f.model->meshes[0].name = "a&<>\"'\n\x01\x7F\xEF\xBF\xBE\xC3\xA4";
  f.model->nodes[0].name = "";
  fixture_refine(&f, 0, false);
  char *text = write_3mf(&f.scene, &metres, 1000);
  assert_non_null(strstr(text, " name=\"a&amp;&lt;>&quot;'    \xC3\xA4\">"));
  assert_null(strstr(text, "partnumber"));
  free(text);
  fixture_deinit(&f);
}

TEST(open_meshes_are_surfaces) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 0, false);
  for (int i = 0; i < 2; i++) {
    const bool is_open = i;
    char *text = write_3mf(&f.scene, &(tw_3mf_options){2, "inch", &is_open}, 1000);
    assert_non_null(strstr(text, i ? "type=\"surface\"" : "type=\"model\""));
    assert_non_null(strstr(text, "<model unit=\"inch\""));
    assert_non_null(strstr(text, "<vertex x=\"6\" y=\"0\" z=\"0.6\"/>"));
    free(text);
  }
  fixture_deinit(&f);
}

TEST(without_memory_there_is_no_stream) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 2, true);
  tw_status status = TW_NO_MEMORY;
  for (size_t failures = 0; status != TW_OK; failures++) {
    tw_3mf_stream *stream = NULL;
    test_memory.left = failures;
    status = tw_3mf_stream_create(&f.scene, &metres, &stream, NULL);
    test_memory.left = SIZE_MAX;
    assert_true(status == TW_OK ? stream && failures > 10 : status == TW_NO_MEMORY && !stream);
    tw_3mf_stream_destroy(stream);
  }
  fixture_deinit(&f);
}

static bool is_over(void *owner) {
  (void)owner;
  return true;
}

/* What is no longer wanted never looks whole. */
TEST(text_that_is_not_wanted_is_cut_off) {
  fixture f;
  fixture_init(&f, patchwork_text);
  fixture_refine(&f, 4, true);
  tw_3mf_stream *stream = open_3mf(&f.scene, &metres);
  tw_meter meter;
  tw_meter_init(&meter, &(tw_meter_host){.is_over = is_over}, 1 << 30);
  tw_meter *before = tw_meter_use(&meter);
  uint8_t block[4096];
  int64_t count;
  while ((count = tw_3mf_stream_read(stream, block, sizeof block)) > 0) continue;
  tw_meter_use(before);
  assert_int_equal(count, -1);
  tw_3mf_stream_destroy(stream);
  fixture_deinit(&f);
}
