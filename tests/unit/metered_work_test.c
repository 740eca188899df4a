/* Long loops tell their work, and end where the result is no longer wanted. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "test.h"
#include "tweend/format.h"
#include "tweend/model.h"

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
  for (uint64_t part = 1; part < 8; part++) {
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
