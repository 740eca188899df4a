/* Reads shapes in tweend JSON; each kind has its own members. */
#include "shape_in.h"

enum { KIND, SIZE, RADIUS, RADII, HEIGHT, TUBE, SEGMENTS, RINGS, SIDES, LEVEL, CAPS, MEMBERS };
static const char *const names[MEMBERS] = {"kind",     "size",  "radius", "radii", "height", "tube",
                                           "segments", "rings", "sides",  "level", "caps"};
#define HAS(member) (1u << (member))
static const unsigned members_of[TW_SHAPES] = {
    HAS(SIZE) | HAS(SEGMENTS),
    HAS(SIZE) | HAS(SEGMENTS),
    HAS(RADIUS) | HAS(SEGMENTS),
    HAS(RADIUS) | HAS(SEGMENTS) | HAS(RINGS),
    HAS(RADIUS) | HAS(LEVEL),
    HAS(RADII) | HAS(SEGMENTS),
    HAS(RADIUS) | HAS(HEIGHT) | HAS(SEGMENTS) | HAS(RINGS) | HAS(CAPS),
    HAS(RADIUS) | HAS(HEIGHT) | HAS(SEGMENTS) | HAS(RINGS) | HAS(CAPS),
    HAS(RADIUS) | HAS(TUBE) | HAS(SEGMENTS) | HAS(SIDES),
};

/* Reads size and segments of a box, or of a grid, which has no y: one number an axis. */
static tw_status read_axes(const api_value *values, tw_shape *shape) {
  bool is_grid = shape->kind == TW_SHAPE_GRID;
  uint32_t width = is_grid ? 2 : 3, count, parts[3] = {1, 1, 1};
  float size[3] = {1, 1, 1};
  tw_status status = api_json_floats(&values[SIZE], width, size);
  if (status == TW_OK) status = api_json_count(&values[SEGMENTS], UINT32_MAX, &count);
  if (status == TW_OK && values[SEGMENTS].item && count != width)
    status = api_json_fail(&values[SEGMENTS], TW_SYNTAX, "%u %s expected, not %u", width,
                           tw_plural(width, "number is", "numbers are"), count);
  if (status == TW_OK) status = api_json_index_list(&values[SEGMENTS], parts);
  for (uint32_t i = 0; i < width; i++) {
    uint32_t axis = is_grid ? 2 * i : i;
    shape->size[axis] = size[i];
    shape->segments[axis] = parts[i];
  }
  return status;
}

typedef struct shape_reader {
  tw_shape *shape;
  tw_shape_counts *counts;
} shape_reader;

static tw_status read_shape(void *context, const api_value *object) {
  static const char *const caps[] = {"ngon", "fan", "none", NULL};
  const shape_reader *reader = context;
  tw_shape *shape = reader->shape;
  api_value values[MEMBERS];
  int kind = TW_SHAPE_GRID;
  tw_status status = api_json_kind(object, names[KIND], tw_shape_names, "a shape needs a kind", &kind);
  if (status == TW_OK)
    status = api_json_members_of(object, names, MEMBERS, HAS(KIND) | members_of[kind], values);
  if (status != TW_OK) return status;
  tw_shape_init(shape, (tw_shape_kind)kind);
  int cap = (int)shape->caps;
  if (kind == TW_SHAPE_GRID || kind == TW_SHAPE_BOX)
    status = read_axes(values, shape);
  else
    status = api_json_index(&values[SEGMENTS], &shape->segments[0]);
  if (status == TW_OK) status = api_json_float(&values[RADIUS], &shape->radii[0]);
  if (status == TW_OK) status = api_json_floats(&values[RADII], 3, shape->radii);
  if (status == TW_OK) status = api_json_float(&values[HEIGHT], &shape->height);
  if (status == TW_OK) status = api_json_float(&values[TUBE], &shape->tube);
  if (status == TW_OK) status = api_json_index(&values[RINGS], &shape->rings);
  if (status == TW_OK) status = api_json_index(&values[SIDES], &shape->sides);
  if (status == TW_OK) status = api_json_index(&values[LEVEL], &shape->level);
  if (status == TW_OK) status = api_json_choice(&values[CAPS], caps, &cap);
  shape->caps = (tw_caps)cap;
  if (status != TW_OK) return status;
  status = tw_shape_count(shape, reader->counts, object->json->error);
  return status == TW_OK ? TW_OK : api_json_fail_within(object, status);
}

tw_status api_shape_in(const api_value *value, tw_shape *out, tw_shape_counts *counts) {
  return api_json_object(value, read_shape, &(shape_reader){out, counts});
}
