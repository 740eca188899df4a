/* Vertices as they are stored. Numbers are rounded to the nearest that the coding has; weights keep their
 * sum. */
#include "vertex_format.h"

#include <string.h>

typedef struct coding_facts {
  int component; /* glTF's */
  uint32_t size; /* bytes of one number */
  bool is_normalized;
} coding_facts;

static const coding_facts FACTS[] = {
    [TW_CODED_FLOATS] = {5126, 4, false},         [TW_CODED_JOINTS] = {5123, 2, false},
    [TW_CODED_ROUNDED_JOINTS] = {5123, 2, false}, [TW_CODED_SMALL_JOINTS] = {5121, 1, false},
    [TW_CODED_WEIGHTS] = {5121, 1, true},         [TW_CODED_PLACES] = {5122, 2, true},
    [TW_CODED_UNITS] = {5120, 1, true},           [TW_CODED_FRACTIONS] = {5123, 2, true},
    [TW_CODED_INT8] = {5120, 1, false},           [TW_CODED_UINT8] = {5121, 1, false},
    [TW_CODED_INT16] = {5122, 2, false},          [TW_CODED_UINT16] = {5123, 2, false},
};

uint32_t tw_vertex_field_size(const tw_vertex_field *field) {
  return (field->width * FACTS[field->coding].size + 3) / 4 * 4;
}

uint32_t tw_vertex_size(const tw_vertex_field *fields, uint32_t field_count) {
  if (field_count == 0) return 0;
  const tw_vertex_field *last = &fields[field_count - 1];
  return last->offset + tw_vertex_field_size(last);
}

bool tw_vertex_is_row(const tw_vertex_field *fields, uint32_t field_count, uint32_t stride) {
  for (uint32_t i = 0; i < field_count; i++)
    if (fields[i].coding != TW_CODED_FLOATS) return false;
  return tw_vertex_size(fields, field_count) == stride * sizeof(float);
}

const tw_vertex_codings tw_vertex_floats = {.joints = TW_CODED_JOINTS};

static void add_field(const char *semantic, tw_vertex_coding coding, uint32_t column, uint32_t width,
                      tw_vertex_field *fields, uint32_t *count) {
  if (column == UINT32_MAX) return;
  fields[*count] = (tw_vertex_field){.semantic = semantic,
                                     .coding = coding,
                                     .column = column,
                                     .width = width,
                                     .offset = tw_vertex_size(fields, *count)};
  ++*count;
}

/* One attribute of joints and one of weights for each four. */
static void add_influences(const tw_surface_layout *layout, const tw_vertex_codings *codings,
                           tw_vertex_field *fields, uint32_t *count) {
  static const char *const names[TW_JOINT_SETS_MAX][2] = {
      {"JOINTS_0", "WEIGHTS_0"}, {"JOINTS_1", "WEIGHTS_1"}, {"JOINTS_2", "WEIGHTS_2"},
      {"JOINTS_3", "WEIGHTS_3"}, {"JOINTS_4", "WEIGHTS_4"}, {"JOINTS_5", "WEIGHTS_5"},
      {"JOINTS_6", "WEIGHTS_6"}, {"JOINTS_7", "WEIGHTS_7"}};
  uint32_t first = *count;
  for (uint32_t set = 0; set < layout->influences / 4; set++) {
    add_field(names[set][0], codings->joints, layout->joints + 4 * set, 4, fields, count);
    add_field(names[set][1], codings->weights, layout->weights + 4 * set, 4, fields, count);
  }
  for (uint32_t i = first; i < *count; i++) {
    fields[i].set = (i - first) / 2;
    fields[i].weights = layout->weights;
    fields[i].influences = layout->influences;
  }
}

static tw_vertex_coding coding_of(const tw_row_attribute *attribute, tw_vertex_coding color) {
  if (attribute->is_color) return color;
  switch (attribute->numbers) {
  case TW_NUMBERS_REAL:
  case TW_NUMBERS_WHOLE: return TW_CODED_FLOATS;
  case TW_NUMBERS_INT8: return TW_CODED_INT8;
  case TW_NUMBERS_UINT8: return TW_CODED_UINT8;
  case TW_NUMBERS_INT16: return TW_CODED_INT16;
  case TW_NUMBERS_UINT16: return TW_CODED_UINT16;
  }
  return TW_CODED_FLOATS;
}

uint32_t tw_vertex_fields(const tw_surface_layout *layout, const tw_vertex_codings *codings,
                          tw_vertex_field fields[TW_VERTEX_FIELDS_MAX]) {
  static const char *const uvs[TW_UV_SETS_MAX] = {"TEXCOORD_0", "TEXCOORD_1", "TEXCOORD_2", "TEXCOORD_3"};
  uint32_t count = 0;
  add_field("POSITION", codings->position, layout->position, 3, fields, &count);
  add_field("NORMAL", codings->normal, layout->normal, 3, fields, &count);
  add_field("TANGENT", codings->tangent, layout->tangent, 4, fields, &count);
  for (uint32_t set = 0; set < layout->uv_count; set++)
    add_field(uvs[set], codings->uvs[set], layout->uvs[set], 2, fields, &count);
  for (uint32_t i = 0; i < layout->attribute_count; i++) {
    const tw_row_attribute *own = &layout->attributes[i];
    add_field(own->name, coding_of(own, codings->color), own->column, own->width, fields, &count);
  }
  add_influences(layout, codings, fields, &count);
  return count;
}

uint32_t tw_vertex_target_column(const tw_surface_layout *layout, uint32_t target_count) {
  return target_count == layout->morph_count ? layout->morphs : layout->morph_width;
}

int tw_vertex_component(tw_vertex_coding coding) {
  return FACTS[coding].component;
}

bool tw_vertex_is_normalized(tw_vertex_coding coding) {
  return FACTS[coding].is_normalized;
}

/* Rounds value * most to an integer. value: from -1 to 1 but for rounding errors, which are clamped. */
static int32_t round_to(float value, float most) {
  float scaled = value * most;
  scaled = scaled < -most ? -most : scaled > most ? most : scaled;
  return (int32_t)(scaled < 0 ? scaled - 0.5f : scaled + 0.5f);
}

/* Rounds the field's four weights. All weights of the row, whose sum is 1, are rounded down; what is missing
 * in the sum of 255 goes to those that lost most. */
static void round_weights(const tw_vertex_field *field, const float *row, uint8_t out[4]) {
  const float *weights = row + field->weights;
  int rest = 255;
  uint8_t rounded[4 * TW_JOINT_SETS_MAX];
  float lost[4 * TW_JOINT_SETS_MAX];
  for (uint32_t i = 0; i < field->influences; i++) {
    rounded[i] = (uint8_t)(weights[i] * 255);
    lost[i] = weights[i] * 255 - (float)rounded[i];
    rest -= rounded[i];
  }
  for (; rest > 0; rest--) {
    uint32_t most = 0;
    for (uint32_t i = 1; i < field->influences; i++)
      if (lost[i] > lost[most]) most = i;
    rounded[most]++;
    lost[most] -= 1;
  }
  memcpy(out, rounded + 4 * (size_t)field->set, 4);
}

static void write_joints(const tw_vertex_field *field, const float *row, uint8_t *out) {
  const float *joints = row + field->column, *weights = row + field->weights + 4 * (size_t)field->set;
  uint16_t written[4];
  for (int i = 0; i < 4; i++) written[i] = weights[i] > 0 ? (uint16_t)joints[i] : 0;
  memcpy(out, written, sizeof written);
}

/* Writes joint 0 where the weight is stored as 0: the glTF validator wants it. */
static void write_rounded_joints(const tw_vertex_field *field, const float *row, bool is_small,
                                 uint8_t *out) {
  const float *joints = row + field->column;
  uint8_t weights[4];
  uint16_t written[4];
  round_weights(field, row, weights);
  for (int i = 0; i < 4; i++) written[i] = weights[i] > 0 ? (uint16_t)joints[i] : 0;
  for (int i = 0; is_small && i < 4; i++) out[i] = (uint8_t)written[i];
  if (!is_small) memcpy(out, written, sizeof written);
}

static void write_places(const tw_vertex_field *field, const float *values, uint8_t *out) {
  for (uint32_t i = 0; i < field->width; i++) {
    int16_t place = (int16_t)round_to((values[i] - field->origin[i]) / field->scale, 32767);
    memcpy(out + 2 * (size_t)i, &place, sizeof place);
  }
}

/* Writes whole numbers as the low bytes of 32 bits, which are those of a shorter integer of either sign. */
static void write_whole(const tw_vertex_field *field, const float *values, uint8_t *out) {
  uint32_t size = FACTS[field->coding].size;
  for (uint32_t i = 0; i < field->width; i++) {
    uint32_t bits = (uint32_t)(int32_t)values[i];
    for (uint32_t k = 0; k < size; k++) out[size * i + k] = (uint8_t)(bits >> 8 * k);
  }
}

static void write_field(const tw_vertex_field *field, const float *row, uint8_t *out) {
  const float *values = row + field->column;
  switch (field->coding) {
  case TW_CODED_FLOATS: memcpy(out, values, field->width * sizeof *values); return;
  case TW_CODED_JOINTS: write_joints(field, row, out); return;
  case TW_CODED_ROUNDED_JOINTS: write_rounded_joints(field, row, false, out); return;
  case TW_CODED_SMALL_JOINTS: write_rounded_joints(field, row, true, out); return;
  case TW_CODED_WEIGHTS: round_weights(field, row, out); return;
  case TW_CODED_PLACES: write_places(field, values, out); return;
  case TW_CODED_UNITS:
    for (uint32_t i = 0; i < field->width; i++) out[i] = (uint8_t)round_to(values[i], 127);
    return;
  case TW_CODED_FRACTIONS:
    for (uint32_t i = 0; i < field->width; i++) {
      uint16_t fraction = (uint16_t)round_to(values[i] > 0 ? values[i] : 0, 65535);
      memcpy(out + 2 * (size_t)i, &fraction, sizeof fraction);
    }
    return;
  case TW_CODED_INT8:
  case TW_CODED_UINT8:
  case TW_CODED_INT16:
  case TW_CODED_UINT16: write_whole(field, values, out); return;
  }
}

void tw_vertex_write(const tw_vertex_field *fields, uint32_t field_count, const float *row, uint8_t *out) {
  for (uint32_t i = 0; i < field_count; i++) {
    uint32_t size = fields[i].width * FACTS[fields[i].coding].size;
    if (size % 4 > 0) memset(out + fields[i].offset + (size - size % 4), 0, 4);
    write_field(&fields[i], row, out + fields[i].offset);
  }
}

void tw_vertex_widen(const tw_vertex_field *field, const uint8_t *element, float min[3], float max[3]) {
  for (uint32_t i = 0; i < field->width; i++) {
    float value;
    int16_t place;
    const uint8_t *at = element + field->offset;
    if (field->coding == TW_CODED_PLACES) {
      memcpy(&place, at + sizeof place * i, sizeof place);
      value = place;
    } else {
      memcpy(&value, at + sizeof value * i, sizeof value);
    }
    if (value < min[i]) min[i] = value;
    if (value > max[i]) max[i] = value;
  }
}
