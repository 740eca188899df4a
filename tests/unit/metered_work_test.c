/* Long loops tell their work, and end where the result is no longer wanted. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "biped.h"
#include "ear_clipping.h"
#include "test.h"
#include "tweend/anim.h"
#include "tweend/clip_report.h"
#include "tweend/format.h"
#include "tweend/json_print.h"
#include "tweend/model.h"
#include "tweend/root_motion.h"
#include "tweend/shape.h"

enum { FACES = 100000 };

typedef tw_status reader(const uint8_t *bytes, size_t size, tw_model **out);

typedef struct clock {
  const tw_meter *meter;
  uint64_t most;
} clock;

static bool is_late(void *owner) {
  const clock *c = owner;
  return atomic_load(&c->meter->steps) >= c->most;
}

/* Reads the bytes, which are wanted for `most` steps. Returns the steps done. */
static uint64_t read_within(reader *read, const uint8_t *bytes, size_t size, uint64_t most,
                            tw_status *status) {
  tw_meter meter;
  clock c = {&meter, most};
  const tw_meter_host host = {.owner = &c, .is_over = is_late};
  tw_meter_init(&meter, &host, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  tw_model *model = NULL;
  *status = read(bytes, size, &model);
  tw_meter_use(before);
  tw_model_destroy(model);
  return atomic_load(&meter.steps);
}

/* A reader tells work in proportion to the faces, and ends soon after it is told to. */
static void assert_ends(reader *read, const uint8_t *bytes, size_t size) {
  tw_status status;
  uint64_t all = read_within(read, bytes, size, UINT64_MAX, &status);
  assert_int_equal(status, TW_OK);
  assert_true(all > 10 * FACES);
  for (uint64_t part = 1; part < 8; part += 3 * test_stride()) {
    uint64_t some = read_within(read, bytes, size, all * part / 8, &status);
    assert_true(status == TW_CANCELLED || status == TW_NO_MEMORY);
    assert_true(some <= all * part / 8 + (1 << 18));
  }
}

/* Three points of a face anywhere in a cube. */
static void any_triangle(uint32_t *seed, float out[9]) {
  for (int i = 0; i < 9; i++) {
    *seed = *seed * 1664525u + 1013904223u;
    out[i] = (float)(*seed >> 8) / (1 << 24);
  }
}

static tw_status read_stl(const uint8_t *bytes, size_t size, tw_model **out) {
  return tw_stl_read(bytes, size, TW_QUADS_OFF, TW_WELD_AUTO, out, NULL);
}

TEST(reading_stl_ends_when_it_is_not_wanted) {
  enum { HEADER = 84, FACET = 50 };
  size_t size = HEADER + (size_t)FACET * FACES;
  uint8_t *bytes = calloc(1, size);
  uint32_t count = FACES, seed = 1;
  memcpy(bytes + HEADER - 4, &count, 4); /* of a little-endian machine */
  for (size_t f = 0; f < FACES; f++) {
    float points[9];
    any_triangle(&seed, points);
    memcpy(bytes + HEADER + FACET * f + 12, points, sizeof points);
  }
  assert_ends(read_stl, bytes, size);
  free(bytes);
}

static tw_status read_obj(const uint8_t *bytes, size_t size, tw_model **out) {
  return tw_obj_read(bytes, size, TW_WELD_AUTO, out, NULL);
}

/* Points whose cells of a grid are all different, in an order without order. */
static tw_status read_near(const uint8_t *bytes, size_t size, tw_model **out) {
  tw_model *model;
  tw_status status = tw_obj_read(bytes, size, TW_WELD_NONE, &model, NULL);
  if (status != TW_OK) return status;
  status = tw_model_weld(model, 1e-6, NULL);
  if (status == TW_OK)
    *out = model;
  else
    tw_model_destroy(model);
  return status;
}

TEST(reading_obj_and_welding_end_when_they_are_not_wanted) {
  enum { LINE = 40 };
  char *text = malloc((size_t)FACES * 4 * LINE);
  size_t size = 0;
  uint32_t seed = 2;
  for (int f = 0; f < FACES; f++) {
    float p[9];
    any_triangle(&seed, p);
    for (int i = 0; i < 9; i += 3)
      size += (size_t)sprintf(text + size, "v %.7f %.7f %.7f\n", (double)p[i], (double)p[i + 1],
                              (double)p[i + 2]);
    size += (size_t)sprintf(text + size, "f -3 -2 -1\n");
  }
  assert_ends(read_obj, (const uint8_t *)text, size);
  assert_ends(read_near, (const uint8_t *)text, size);
  free(text);
}

/* A little text, and much of another that is short. */
static char *print_much(const char *before, const char *piece, size_t count, const char *after) {
  char *text = malloc(strlen(before) + strlen(piece) * count + strlen(after) + 1);
  char *end = stpcpy(text, before);
  for (size_t i = 0; i < count; i++) end = stpcpy(end, piece);
  strcpy(end, after);
  return text;
}

TEST(reading_text_without_faces_ends_when_it_is_not_wanted) {
  const char triangle[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  char *comments = print_much(triangle, "#\n", 10 * FACES, ""), tag[120];
  snprintf(tag, sizeof tag, "%st corner %d/1/0", triangle, 5 * FACES);
  char *indices = print_much(tag, " 0", 5 * FACES, " 1.0\n");
  char *facets = print_much(
      "solid\n", "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n",
      FACES, "endsolid\n");
  assert_ends(read_obj, (const uint8_t *)comments, strlen(comments));
  assert_ends(read_obj, (const uint8_t *)indices, strlen(indices));
  assert_ends(read_stl, (const uint8_t *)facets, strlen(facets));
  free(comments);
  free(indices);
  free(facets);
}

static tw_status read_ply(const uint8_t *bytes, size_t size, tw_model **out) {
  return tw_ply_read(bytes, size, TW_WELD_AUTO, out, NULL);
}

TEST(reading_ply_ends_when_it_is_not_wanted) {
  enum { POINT = 12, FACE = 13 };
  char *bytes = malloc(500 + (size_t)FACES * (3 * POINT + FACE));
  size_t size = (size_t)sprintf(bytes,
                                "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\n"
                                "property float y\nproperty float z\nelement face %d\n"
                                "property list uchar int vertex_indices\nend_header\n",
                                3 * FACES, FACES);
  uint32_t seed = 3;
  for (int f = 0; f < FACES; f++, size += 3 * POINT) {
    float points[9];
    any_triangle(&seed, points);
    memcpy(bytes + size, points, sizeof points);
  }
  for (uint32_t f = 0; f < FACES; f++, size += FACE) {
    const uint32_t corners[3] = {3 * f, 3 * f + 1, 3 * f + 2};
    bytes[size] = 3;
    memcpy(bytes + size + 1, corners, sizeof corners);
  }
  assert_ends(read_ply, (const uint8_t *)bytes, size);
  free(bytes);
}

/* Prints a name of quotes, each of which is escaped, as often as there are faces. */
static tw_status print_names(const uint8_t *bytes, size_t size, tw_model **out) {
  tw_text text = {0};
  for (int i = 0; i < FACES; i++) tw_text_quoted(&text, (const char *)bytes, size);
  bool has_failed = text.failed;
  tw_text_deinit(&text);
  if (has_failed) return TW_CANCELLED;
  *out = tw_model_create();
  return TW_OK;
}

TEST(printing_ends_when_it_is_not_wanted) {
  uint8_t name[200];
  memset(name, '"', sizeof name);
  assert_ends(print_names, name, sizeof name);
}

/* Follows a track whose angles turn much from key to key. bytes: not read. */
static tw_status follow_track(const uint8_t *bytes, size_t size, tw_model **out) {
  enum { KEYS = 300 };
  float times[KEYS];
  double angles[3 * KEYS];
  tw_track_report report;
  (void)bytes, (void)size;
  for (int i = 0; i < KEYS; i++) times[i] = (float)i;
  for (int i = 0; i < 3 * KEYS; i++) angles[i] = i * 7919 % 1009;
  const tw_track_keys keys = {.path = TW_ROTATION,
                              .form = TW_KEY_EULER,
                              .interpolation = TW_EULER,
                              .width = 3,
                              .key_count = KEYS,
                              .times = times,
                              .angles = angles};
  tw_status status = tw_track_inspect(&keys, TW_TRACK_STEPS, &report, NULL);
  if (status == TW_OK) *out = tw_model_create();
  return status;
}

TEST(following_a_track_ends_when_it_is_not_wanted) {
  assert_ends(follow_track, NULL, 0);
}

/* Takes the arena along: what was made in it is not looked at. */
static tw_status ended(tw_status status, tw_arena *arena, tw_model **out) {
  tw_arena_destroy(arena);
  if (status == TW_OK) *out = tw_model_create();
  return status;
}

/* Judges a clip with one long track. */
static tw_status judge_clip(const uint8_t *bytes, size_t size, tw_model **out) {
  enum { KEYS = 50000 };
  static float times[KEYS], values[KEYS][4];
  tw_clip_report report;
  const tw_node node = {
      .parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  const uint32_t order = 0;
  (void)bytes, (void)size;
  for (int i = 0; i < KEYS; i++) {
    times[i] = (float)i / 60;
    values[i][2] = sinf((float)i / 100);
    values[i][3] = cosf((float)i / 100);
  }
  const tw_track_keys track = {.path = TW_ROTATION,
                               .interpolation = TW_LINEAR,
                               .form = TW_KEY_QUATERNION,
                               .width = 4,
                               .key_count = KEYS,
                               .times = times,
                               .values = values[0]};
  const tw_clip_keys keys = {.track_count = 1, .tracks = &track};
  tw_arena *arena = tw_arena_create();
  if (!arena) return TW_NO_MEMORY;
  const tw_inspect_job job = {.keys = &keys, .nodes = &node, .order = &order, .node_count = 1};
  return ended(tw_clip_inspect(&job, arena, &report, NULL), arena, out);
}

TEST(judging_a_clip_ends_when_it_is_not_wanted) {
  assert_ends(judge_clip, NULL, 0);
}

static uint32_t keys_found;

/* Finds keys for what is left of a node that turns on splines, flying far out between its keys, without its
 * yaw. */
static tw_status reduce_rooted(const uint8_t *bytes, size_t size, tw_model **out) {
  enum { KEYS = 3 };
  float times[KEYS], values[KEYS][3][3], turns[KEYS][3][4];
  uint32_t seed = 4;
  (void)bytes, (void)size;
  for (int i = 0; i < KEYS; i++) {
    float more[9];
    times[i] = (float)i;
    any_triangle(&seed, values[i][0]);
    any_triangle(&seed, more);
    for (int part = 0; part < 3; part++) {
      for (int c = 0; c < 3; c++) values[i][part][c] = (part == 1 ? 1 : 1e3F) * (values[i][part][c] - 0.5F);
      for (int c = 0; c < 3; c++) turns[i][part][c] = (part == 1 ? 1 : 1e3F) * (more[3 * part + c] - 0.5F);
      turns[i][part][3] = part == 1;
    }
  }
  tw_track_keys tracks[2] = {
      {.path = TW_TRANSLATION, .width = 3, .values = values[0][0]},
      {.path = TW_ROTATION, .width = 4, .values = turns[0][0], .form = TW_KEY_QUATERNION}};
  for (int i = 0; i < 2; i++) {
    tracks[i].interpolation = TW_CUBICSPLINE;
    tracks[i].key_count = KEYS;
    tracks[i].times = times;
  }
  const tw_clip_keys keys = {.track_count = 2, .tracks = tracks};
  const tw_node node = {
      .parent = TW_NO_INDEX, .mesh = TW_NO_INDEX, .skin = TW_NO_INDEX, .rest = TW_TRS_IDENTITY};
  const tw_root_job job = {.nodes = &node, .node_count = 1, .axes = TW_ROOT_YAW, .carrier = TW_NO_INDEX};
  tw_clip *clip, *rooted;
  if (tw_clip_create(&keys, 1, -1, &clip, NULL) != TW_OK) return TW_INVALID;
  if (tw_clip_take_root(clip, &job, &rooted, NULL) != TW_OK) return TW_INVALID;
  tw_arena *arena = tw_arena_create();
  tw_clip_keys reduced;
  tw_tolerance reached;
  uint64_t places = TW_REDUCTION_STEPS;
  tw_status status = tw_clip_reduce(rooted, NULL, (tw_tolerance){1e-3, 1e-3}, 1u << 20, &places, arena,
                                    &reduced, &reached, NULL);
  if (status == TW_OK) keys_found = reduced.tracks[0].key_count + reduced.tracks[1].key_count;
  tw_clip_destroy(rooted);
  return ended(status, arena, out);
}

TEST(reducing_a_clip_without_keys_ends_when_it_is_not_wanted) {
  assert_ends(reduce_rooted, NULL, 0);
}

/* A key takes one search for where the path strays most from its chord, of 48 samples. Chords that stray at
 * places of the grid already are cut without one: there are four times as many. */
TEST(only_chords_that_hold_are_searched_for_the_most_they_stray) {
  enum { SAMPLES = 48, STEPS = 32, TRACKS = 4 }; /* of a sample; tracks that it asks for */
  tw_status status;
  uint64_t steps = read_within(reduce_rooted, NULL, 0, UINT64_MAX, &status);
  assert_int_equal(status, TW_OK);
  assert_true(keys_found > 1000);
  assert_true(steps < (uint64_t)2 * SAMPLES * STEPS * TRACKS * keys_found);
}

/* Carries long tracks over to a skeleton with fewer bones, whose turns are products of several. */
static tw_status carry_clip(const uint8_t *bytes, size_t size, tw_model **out) {
  enum { KEYS = 5000 };
  static biped source, target;
  static float times[KEYS], values[BIPED_MOST][KEYS][4];
  tw_retargeted carried;
  (void)bytes, (void)size;
  biped_make(&source, (biped_options){.spines = 3});
  biped_make(&target, (biped_options){.spines = 1});
  biped_animate(&source, 1, 5);
  for (uint32_t t = 0; t < source.clip.track_count; t++) {
    tw_track_keys *track = &source.tracks[t];
    if (track->path != TW_ROTATION) continue;
    for (int i = 0; i < KEYS; i++) {
      times[i] = (float)i / 60;
      memcpy(values[track->node][i], track->values, 4 * sizeof(float));
    }
    track->key_count = KEYS;
    track->times = times;
    track->values = values[track->node][0];
  }
  const tw_retarget_job job = {
      .source = {.nodes = source.nodes, .order = source.order, .node_count = source.count},
      .target = {.nodes = target.nodes, .order = target.order, .node_count = target.count},
      .keys = &source.clip,
      .tolerance = {1e-3, 1e-3},
      .max_keys = 10 * KEYS};
  tw_arena *arena = tw_arena_create();
  if (!arena) return TW_NO_MEMORY;
  return ended(tw_retarget_run(&job, arena, &carried, NULL), arena, out);
}

TEST(carrying_a_clip_over_ends_when_it_is_not_wanted) {
  assert_ends(carry_clip, NULL, 0);
}

/* Cuts a wound-up strip, beside each ear of which are hundreds of corners. */
static tw_status clip_ears(const uint8_t *bytes, size_t size, tw_model **out) {
  enum { CORNERS = 20000, SIDE = CORNERS / 2 };
  static float at[CORNERS][3];
  static const float *points[CORNERS];
  static uint32_t names[CORNERS], triangles[CORNERS][3];
  uint32_t count;
  (void)bytes, (void)size;
  for (int i = 0; i < CORNERS; i++) {
    int along = i < SIDE ? i : CORNERS - 1 - i;
    float angle = 0.05f * (float)along, far = (1 + 1e-3f * (float)along) * (i < SIDE ? 1 : 0.999f);
    at[i][0] = far * cosf(angle);
    at[i][1] = far * sinf(angle);
    points[i] = at[i];
    names[i] = (uint32_t)i;
  }
  tw_ear_clipper clipper;
  tw_arena *arena = tw_arena_create();
  bool has_memory = arena && tw_ear_clipper_init(&clipper, arena, CORNERS);
  if (!has_memory) return ended(TW_NO_MEMORY, arena, out);
  tw_ear_clipper_take(&clipper, points, CORNERS);
  return ended(tw_ear_clipper_cut(&clipper, names, NULL, triangles, &count), arena, out);
}

TEST(cutting_a_polygon_ends_when_it_is_not_wanted) {
  assert_ends(clip_ears, NULL, 0);
}

static tw_status make_shape(const uint8_t *bytes, size_t size, tw_model **out) {
  tw_shape shape;
  tw_mesh mesh;
  (void)bytes, (void)size;
  tw_shape_init(&shape, TW_SHAPE_QUAD_SPHERE);
  shape.segments[0] = 60;
  tw_arena *arena = tw_arena_create();
  if (!arena) return TW_NO_MEMORY;
  return ended(tw_shape_make(&shape, arena, &mesh, NULL), arena, out);
}

TEST(sorting_the_points_of_a_shape_ends_when_it_is_not_wanted) {
  assert_ends(make_shape, NULL, 0);
}

/* Writes a glTF without surfaces. */
static tw_status write_gltf(const uint8_t *bytes, size_t size, tw_model **out) {
  const tw_scene scene = {.model = (const tw_model *)(const void *)bytes};
  tw_gltf_stream *stream;
  (void)size;
  tw_status status = tw_gltf_stream_create(&scene, TW_FORMAT_GLTF, &stream, NULL);
  if (status != TW_OK) return status;
  tw_gltf_stream_destroy(stream);
  *out = tw_model_create();
  return TW_OK;
}

/* What a file keeps for answers is walked once for each level that it is nested. */
TEST(writing_nested_text_ends_when_it_is_not_wanted) {
  enum { DEPTH = 40, ITEM = 4 };
  char *text = malloc(200 + 2 * DEPTH + (size_t)ITEM * FACES), *end = text;
  end += sprintf(end, "{\"asset\":{\"version\":\"2.0\"},\"materials\":[{\"x\":");
  for (int i = 0; i < DEPTH; i++) *end++ = '[';
  for (int i = 0; i < FACES; i++) end = (char *)memcpy(end, "[0],", ITEM) + ITEM;
  end--;
  for (int i = 0; i < DEPTH; i++) *end++ = ']';
  end += sprintf(end, "}]}");
  tw_model *model;
  assert_int_equal(
      tw_gltf_read((const uint8_t *)text, (size_t)(end - text), TW_QUADS_NGON, TW_WELD_AUTO, 0, &model, NULL),
      TW_OK);
  assert_ends(write_gltf, (const uint8_t *)model, 0);
  tw_model_destroy(model);
  free(text);
}

/* From its first false on, tw_work is false: loops inside loops end, too. */
TEST(work_that_is_over_stays_over) {
  tw_meter meter;
  clock c = {&meter, 1 << 20};
  tw_meter_init(&meter, &(tw_meter_host){.owner = &c, .is_over = is_late}, UINT64_MAX);
  tw_meter *before = tw_meter_use(&meter);
  uint64_t steps = 0;
  while (tw_work(100)) steps += 100;
  for (int i = 0; i < 100000; i++) assert_false(tw_work(1));
  tw_meter_use(before);
  assert_true(steps > (1 << 20) - (1 << 17) && steps < (1 << 20) + (1 << 17));
}
