/* What a pose looks like in each form. */
#include "pose_print.h"

#include "pose_frame.h"

#include <string.h>

static const char translation_columns[] = "translation_x,translation_y,translation_z";
static const char scale_columns[] = "scale_x,scale_y,scale_z";
static const api_pose_part trs_parts[] = {
    {"rotation", 0, 4, TW_ROTATION, "rotation_x,rotation_y,rotation_z,rotation_w"},
    {"translation", 4, 3, TW_TRANSLATION, translation_columns},
    {"scale", 7, 3, TW_SCALE, scale_columns},
    {0}};
static const api_pose_part matrix_parts[] = {
    {"matrix", 0, 16, TW_ROTATION, "m0,m1,m2,m3,m4,m5,m6,m7,m8,m9,m10,m11,m12,m13,m14,m15"}, {0}};
static const api_pose_part euler_parts[] = {{"euler", 0, 3, TW_ROTATION, "euler_x,euler_y,euler_z"},
                                            {"translation", 3, 3, TW_TRANSLATION, translation_columns},
                                            {"scale", 6, 3, TW_SCALE, scale_columns},
                                            {0}};
static const api_pose_part axis_angle_parts[] = {
    {"axis_angle", 0, 4, TW_ROTATION, "axis_x,axis_y,axis_z,angle"},
    {"translation", 4, 3, TW_TRANSLATION, translation_columns},
    {"scale", 7, 3, TW_SCALE, scale_columns},
    {0}};

const api_pose_part *api_pose_parts(api_pose_as as) {
  static const api_pose_part *const all[] = {trs_parts, matrix_parts, euler_parts, axis_angle_parts};
  return all[as];
}

size_t api_pose_width(api_pose_as as) {
  static const uint8_t widths[] = {10, 16, 9, 10};
  return widths[as];
}

static void print_node_names(const api_pose_query *query, api_text *text) {
  api_text_member(text, "nodes");
  if (query->clip && api_pose_has_all_nodes(query))
    api_text_add(text, query->clip->node_names);
  else
    api_node_names_print(query->model, query->nodes, query->node_count, text);
}

/* Which of the joints are whose. */
static void print_skins(const api_pose_query *query, api_text *text) {
  uint64_t first = 0;
  api_text_member(text, "skins");
  api_text_add(text, "[");
  for (uint32_t i = 0; i < query->model->skin_count; i++) {
    const tw_skin *skin = &query->model->skins[i];
    api_text_element(text);
    api_text_add(text, "{");
    api_text_member(text, "name");
    api_text_string(text, skin->name);
    api_text_member(text, "first");
    api_text_count(text, first);
    api_text_member(text, "count");
    api_text_count(text, skin->joint_count);
    api_text_add(text, "}");
    first += skin->joint_count;
  }
  api_text_add(text, "]");
}

/* What a borrowed clip moves and the model does not have. */
static void print_warnings(const api_clip *clip, api_text *text) {
  api_text_member(text, "warnings");
  api_text_add(text, "[");
  for (uint32_t i = 0; i < clip->missing_count; i++) {
    api_text sentence = {0};
    api_text_add(&sentence, "the clip moves a node that the model does not have: ");
    api_text_add(&sentence, clip->missing[i]);
    api_text_bytes(&sentence, "", 1);
    api_text_element(text);
    if (!sentence.failed) api_text_string(text, sentence.data);
    text->failed |= sentence.failed;
    api_text_deinit(&sentence);
  }
  api_text_add(text, "]");
}

/* The members that say what the answer is; leaves the object open. */
void api_pose_print_heading(const api_pose_query *query, api_text *text) {
  static const char *const forms[] = {"trs", "matrix", "euler", "axis-angle"};
  api_text_add(text, "{");
  api_text_member(text, "clip");
  api_text_string(text, query->clip ? query->clip->name : NULL);
  api_text_member(text, "duration");
  api_text_float(text, query->clip ? tw_clip_duration(query->clip->compiled) : 0);
  api_text_member(text, "space");
  api_text_string(text, query->is_world ? "world" : "local");
  api_text_member(text, "as");
  api_text_string(text, forms[query->as]);
  if (query->as == API_AS_EULER) {
    api_text_member(text, "order");
    api_text_string(text, tw_euler_order_names[query->order]);
  }
  if (query->as == API_AS_EULER || query->as == API_AS_AXIS_ANGLE) {
    api_text_member(text, "unit");
    api_text_string(text, query->in_degrees ? "degrees" : "radians");
  }
  if (query->clip && query->clip->missing_count > 0) {
    print_warnings(query->clip, text);
  }
  print_node_names(query, text);
  if (query->is_skinning) print_skins(query, text);
}

/* Where a node's numbers stand in a row of the binary form. */
void api_pose_print_layout(const api_pose_query *query, api_text *text) {
  size_t width = api_pose_width(query->as);
  api_text_member(text, "poses");
  api_text_count(text, query->times.count);
  api_text_member(text, "stride");
  api_text_count(text, width * query->node_count);
  api_text_member(text, "node_stride");
  api_text_count(text, width);
  api_text_member(text, "layout");
  api_text_add(text, "[");
  for (const api_pose_part *part = api_pose_parts(query->as); part->name; part++) {
    api_text_element(text);
    api_text_add(text, "{");
    api_text_member(text, "name");
    api_text_string(text, part->name);
    api_text_member(text, "offset");
    api_text_count(text, part->offset);
    api_text_member(text, "byte_offset");
    api_text_count(text, part->offset * sizeof(float));
    api_text_member(text, "components");
    api_text_count(text, part->width);
    api_text_add(text, "}");
  }
  api_text_add(text, "]");
}

static void print_parts(const api_pose_query *query, const float *row, api_text *text) {
  size_t width = api_pose_width(query->as);
  for (const api_pose_part *part = api_pose_parts(query->as); part->name; part++) {
    api_text_member(text, part->name);
    api_text_add(text, "[");
    api_text_vectors(text, row + part->offset, width, part->width, query->node_count);
    api_text_add(text, "]");
  }
  api_text_add(text, "}");
}

static void print_json_pose(const api_pose_query *query, uint64_t index, const float *row,
                            const api_pose_frame *frame, api_text *text) {
  api_text_add(text, "{\"t\":");
  api_times_print_one(&query->times, index, text);
  if (frame)
    api_pose_frame_print(query, frame, row, text);
  else
    print_parts(query, row, text);
}

/* A CSV field, quoted where RFC 4180 asks for it. */
static void print_csv_text(api_text *text, const char *value) {
  if (!value[strcspn(value, ",\"\r\n")]) {
    api_text_add(text, value);
    return;
  }
  api_text_add(text, "\"");
  for (; *value; value++) {
    if (*value == '"') api_text_add(text, "\"");
    api_text_bytes(text, value, 1);
  }
  api_text_add(text, "\"");
}

/* Numbers of a few nodes are printed at once, since that is sooner, and then dealt out to their lines. */
static void print_csv_pose(const api_pose_query *query, uint64_t index, const float *row, api_text *text) {
  enum { FEW = 6, WIDEST = 16, BRACKETS = 3 };
  size_t width = api_pose_width(query->as), ends[FEW];
  char buffer[24], number[TW_NUMBER_TEXT], printed[FEW * (WIDEST * TW_FLOAT_TEXT + BRACKETS)];
  size_t digits = tw_print_float(number, api_times_get(&query->times, index));
  for (uint32_t i = 0; i < query->node_count; i++) {
    uint32_t left = query->node_count - i, of = i % FEW;
    if (of == 0)
      tw_print_vectors(printed, &(tw_vectors){row + i * width, width, width, left < FEW ? left : FEW, ends});
    size_t start = of > 0 ? ends[of - 1] + strlen(",[") : strlen("[");
    api_text_bytes(text, number, digits);
    api_text_bytes(text, ",", 1);
    print_csv_text(text, tw_model_node_name(query->model, query->nodes[i], buffer));
    api_text_bytes(text, ",", 1);
    api_text_bytes(text, printed + start, ends[of] - strlen("]") - start);
    api_text_bytes(text, "\r\n", 2);
  }
}

void api_pose_print_u32(uint32_t value, api_text *text) {
  const char bytes[4] = {(char)(value & 0xFF), (char)(value >> 8 & 0xFF), (char)(value >> 16 & 0xFF),
                         (char)(value >> 24)};
  api_text_bytes(text, bytes, sizeof bytes);
}

void api_pose_print_row(const api_pose_query *query, uint64_t index, const float *row,
                        const api_pose_frame *frame, api_text *text) {
  switch (query->form) {
  case API_POSE_JSON:
    api_text_element(text);
    print_json_pose(query, index, row, frame, text);
    break;
  case API_POSE_NDJSON:
    print_json_pose(query, index, row, frame, text);
    api_text_add(text, "\n");
    break;
  case API_POSE_BIN: break; /* is evaluated where it is sent from */
  case API_POSE_CSV: print_csv_pose(query, index, row, text); break;
  }
}

void api_pose_print_columns(const api_pose_query *query, api_text *text) {
  api_text_add(text, "t,node");
  for (const api_pose_part *part = api_pose_parts(query->as); part->name; part++) {
    api_text_add(text, ",");
    api_text_add(text, part->columns);
  }
  api_text_add(text, "\r\n");
}

uint64_t api_pose_measure_times(const api_pose_query *query) {
  if (query->times.printed) return query->times.printed_size;
  uint64_t size = query->times.count > 0 ? query->times.count - 1 : 0;
  char number[TW_NUMBER_TEXT];
  for (uint64_t i = 0; i < query->times.count; i++)
    size += tw_print_float(number, api_times_get(&query->times, i));
  return size;
}
