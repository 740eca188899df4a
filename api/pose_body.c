/* Poses on the wire: times are evaluated in small blocks, each pose is printed as it is read. */
#include "pose_body.h"

#include <string.h>

/* Local transforms of one block: enough times at once for the clip's work track by track. */
enum { BLOCK_BYTES = 256 * 1024, BLOCK_TIMES = 64 };

/* A piece of text is printed in steps of about this many bytes. */
enum { PIECE = 32 * 1024 };

/* In a radian. */
static const double DEGREES = 57.295779513082320877;

/* What of the answer comes next. */
typedef enum pose_phase {
  PHASE_HEAD,
  PHASE_TIMES,
  PHASE_OPEN_POSES,
  PHASE_POSES,
  PHASE_TAIL,
  PHASE_END
} pose_phase;

struct api_pose_body {
  api_pose_query query;
  pose_phase phase;
  uint64_t next; /* time or pose */
  api_text text; /* printed and not yet read */
  size_t read;   /* of text */
  uint64_t size;
  uint32_t padding; /* spaces behind a binary answer's header */

  uint32_t block_times, block_count, block_next;
  float *sampled;    /* [block_times], folded onto the clip */
  tw_trs *locals;    /* [block_times][nodes of the model] */
  float *matrices;   /* [nodes of the model][16]; NULL where nothing asks for matrices */
  float *joints;     /* [node_count][16] with is_skinning */
  float (*euler)[3]; /* [node_count], the pose before; NULL unless asked for */
  float *row;        /* [node_count][width] */
};

/* What a pose says of each node, in the order of the answer. */
typedef struct pose_part {
  const char *name;
  uint32_t offset, width; /* floats, from the node's first */
  const char *columns;    /* of CSV */
} pose_part;

static const pose_part trs_parts[] = {{"rotation", 0, 4, "rotation_x,rotation_y,rotation_z,rotation_w"},
                                      {"translation", 4, 3, "translation_x,translation_y,translation_z"},
                                      {"scale", 7, 3, "scale_x,scale_y,scale_z"},
                                      {0}};
static const pose_part matrix_parts[] = {
    {"matrix", 0, 16, "m0,m1,m2,m3,m4,m5,m6,m7,m8,m9,m10,m11,m12,m13,m14,m15"}, {0}};
static const pose_part euler_parts[] = {{"euler", 0, 3, "euler_x,euler_y,euler_z"},
                                        {"translation", 3, 3, "translation_x,translation_y,translation_z"},
                                        {"scale", 6, 3, "scale_x,scale_y,scale_z"},
                                        {0}};
static const pose_part axis_angle_parts[] = {
    {"axis_angle", 0, 4, "axis_x,axis_y,axis_z,angle"},
    {"translation", 4, 3, "translation_x,translation_y,translation_z"},
    {"scale", 7, 3, "scale_x,scale_y,scale_z"},
    {0}};

static const pose_part *const all_parts[] = {trs_parts, matrix_parts, euler_parts, axis_angle_parts};

size_t api_pose_width(api_pose_as as) {
  size_t width = 0;
  for (const pose_part *part = all_parts[as]; part->name; part++) width += part->width;
  return width;
}

/* ---- evaluating ------------------------------------------------------------------------------- */

static void evaluate_block(api_pose_body *body) {
  const api_pose_query *query = &body->query;
  uint64_t left = query->times.count - body->next;
  uint32_t count = left < body->block_times ? (uint32_t)left : body->block_times;
  uint32_t nodes = query->model->node_count;
  body->block_count = count;
  body->block_next = 0;
  if (!query->clip) {
    for (size_t i = 0; i < (size_t)count * nodes; i++) body->locals[i] = query->model->nodes[i % nodes].rest;
    return;
  }
  float duration = tw_clip_duration(query->clip->compiled);
  for (uint32_t i = 0; i < count; i++)
    body->sampled[i] = tw_loop_time(api_times_get(&query->times, body->next + i), duration, query->loop);
  tw_clip_poses(query->clip->compiled, query->model->nodes, nodes, body->sampled, count, body->locals);
}

/* Matrices of the block's pose: local, or world. */
static void evaluate_matrices(api_pose_body *body, const tw_trs *locals) {
  const tw_model *model = body->query.model;
  const tw_clip *clip = body->query.clip ? body->query.clip->compiled : NULL;
  tw_pose_locals(clip, model->nodes, model->node_count, locals, body->matrices);
  if (body->query.is_world || body->query.is_skinning)
    tw_pose_world(model->nodes, model->node_order, model->node_count, body->matrices, body->matrices);
  float *joints = body->joints;
  for (uint32_t i = 0; joints && i < model->skin_count; i++) {
    tw_skin_matrices(&model->skins[i], body->matrices, joints);
    joints += (size_t)model->skins[i].joint_count * 16;
  }
}

static void put_euler(api_pose_body *body, const tw_trs *local, uint32_t index, float *out) {
  const api_pose_query *query = &body->query;
  float *previous = body->euler[index];
  if (body->next == 0)
    tw_quat_to_euler(local->rotation, query->order, out);
  else
    tw_quat_to_euler_near(local->rotation, query->order, previous, out);
  memcpy(previous, out, sizeof body->euler[index]);
  for (int i = 0; query->in_degrees && i < 3; i++) out[i] = (float)((double)out[i] * DEGREES);
}

/* One node's numbers, as all_parts orders them. */
static void put_node(api_pose_body *body, const tw_trs *local, uint32_t index, float *out) {
  const api_pose_query *query = &body->query;
  switch (query->as) {
  case API_AS_MATRIX: return;
  case API_AS_TRS:
    memcpy(out, local->rotation, sizeof local->rotation);
    out += 4;
    break;
  case API_AS_EULER:
    put_euler(body, local, index, out);
    out += 3;
    break;
  case API_AS_AXIS_ANGLE:
    tw_quat_to_axis_angle(local->rotation, out);
    if (query->in_degrees) out[3] = (float)((double)out[3] * DEGREES);
    out += 4;
    break;
  }
  memcpy(out, local->translation, sizeof local->translation);
  memcpy(out + 3, local->scale, sizeof local->scale);
}

/* Fills the row with the next pose. */
static void evaluate_pose(api_pose_body *body) {
  const api_pose_query *query = &body->query;
  if (body->block_next == body->block_count) evaluate_block(body);
  const tw_trs *locals = body->locals + (size_t)body->block_next++ * query->model->node_count;
  if (body->matrices) evaluate_matrices(body, locals);
  size_t width = api_pose_width(query->as);
  for (uint32_t i = 0; i < query->node_count; i++) {
    uint32_t node = query->nodes[i];
    float *out = body->row + i * width;
    if (!body->matrices) {
      put_node(body, &locals[node], i, out);
    } else if (query->as == API_AS_MATRIX) {
      const float *matrix = body->joints ? body->joints + (size_t)i * 16 : body->matrices + (size_t)node * 16;
      memcpy(out, matrix, 16 * sizeof *out);
    } else {
      tw_trs world;
      tw_trs_from_matrix(body->matrices + (size_t)node * 16, &world); /* shear has no place in it */
      put_node(body, &world, i, out);
    }
  }
}

/* ---- printing --------------------------------------------------------------------------------- */

static void print_node_names(const api_pose_query *query, api_text *text) {
  char buffer[24];
  api_text_member(text, "nodes");
  api_text_add(text, "[");
  for (uint32_t i = 0; i < query->node_count; i++) {
    api_text_element(text);
    api_text_string(text, tw_model_node_name(query->model, query->nodes[i], buffer));
  }
  api_text_add(text, "]");
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
static void print_heading(const api_pose_query *query, api_text *text) {
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
static void print_layout(const api_pose_query *query, api_text *text) {
  size_t width = api_pose_width(query->as);
  api_text_member(text, "poses");
  api_text_count(text, query->times.count);
  api_text_member(text, "stride");
  api_text_count(text, width * query->node_count);
  api_text_member(text, "node_stride");
  api_text_count(text, width);
  api_text_member(text, "layout");
  api_text_add(text, "[");
  for (const pose_part *part = all_parts[query->as]; part->name; part++) {
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

static void print_json_pose(const api_pose_body *body, api_text *text) {
  const api_pose_query *query = &body->query;
  size_t width = api_pose_width(query->as);
  api_text_add(text, "{");
  api_text_member(text, "t");
  api_text_float(text, api_times_get(&query->times, body->next));
  for (const pose_part *part = all_parts[query->as]; part->name; part++) {
    api_text_member(text, part->name);
    api_text_add(text, "[");
    for (uint32_t i = 0; i < query->node_count; i++) {
      api_text_element(text);
      api_text_floats(text, body->row + i * width + part->offset, part->width);
    }
    api_text_add(text, "]");
  }
  api_text_add(text, "}");
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

static void print_csv_pose(const api_pose_body *body, api_text *text) {
  const api_pose_query *query = &body->query;
  size_t width = api_pose_width(query->as);
  char buffer[24];
  for (uint32_t i = 0; i < query->node_count; i++) {
    api_text_float(text, api_times_get(&query->times, body->next));
    api_text_add(text, ",");
    print_csv_text(text, tw_model_node_name(query->model, query->nodes[i], buffer));
    for (size_t j = 0; j < width; j++) {
      api_text_add(text, ",");
      api_text_float(text, body->row[i * width + j]);
    }
    api_text_add(text, "\r\n");
  }
}

/* Little-endian float32, whatever the machine's order. */
static void print_binary_pose(const api_pose_body *body, api_text *text) {
  size_t count = api_pose_width(body->query.as) * body->query.node_count;
  for (size_t i = 0; i < count; i++) {
    uint32_t bits;
    memcpy(&bits, &body->row[i], sizeof bits);
    const char bytes[4] = {(char)(bits & 0xFF), (char)(bits >> 8 & 0xFF), (char)(bits >> 16 & 0xFF),
                           (char)(bits >> 24)};
    api_text_bytes(text, bytes, sizeof bytes);
  }
}

static void print_pose(const api_pose_body *body, api_text *text) {
  switch (body->query.form) {
  case API_POSE_JSON:
    api_text_element(text);
    print_json_pose(body, text);
    break;
  case API_POSE_NDJSON:
    print_json_pose(body, text);
    api_text_add(text, "\n");
    break;
  case API_POSE_BIN: print_binary_pose(body, text); break;
  case API_POSE_CSV: print_csv_pose(body, text); break;
  }
}

/* ---- the binary form's header ------------------------------------------------------------------- */

/* Magic, version, length of the JSON. */
enum { BIN_PREFIX = 12 };

static void print_u32(api_text *text, uint32_t value) {
  const char bytes[4] = {(char)(value & 0xFF), (char)(value >> 8 & 0xFF), (char)(value >> 16 & 0xFF),
                         (char)(value >> 24)};
  api_text_bytes(text, bytes, sizeof bytes);
}

/* Bytes of the header's JSON without padding: all that is printed, and the times, which are counted one by
 * one. False without memory. */
static bool measure_header(const api_pose_query *query, uint64_t *size) {
  api_text text = {0};
  print_heading(query, &text);
  print_layout(query, &text);
  api_text_add(&text, ",\"times\":[]}");
  uint64_t total = text.size + (query->times.count > 0 ? query->times.count - 1 : 0);
  bool failed = text.failed;
  api_text_deinit(&text);
  char number[TW_NUMBER_TEXT];
  for (uint64_t i = 0; i < query->times.count; i++)
    total += tw_print_float(number, api_times_get(&query->times, i));
  *size = total;
  return !failed;
}

/* ---- phases ------------------------------------------------------------------------------------ */

static void print_csv_head(const api_pose_body *body, api_text *text) {
  api_text_add(text, "t,node");
  for (const pose_part *part = all_parts[body->query.as]; part->name; part++) {
    api_text_add(text, ",");
    api_text_add(text, part->columns);
  }
  api_text_add(text, "\r\n");
}

static void print_head(api_pose_body *body, api_text *text) {
  body->phase = PHASE_POSES;
  switch (body->query.form) {
  case API_POSE_NDJSON: return;
  case API_POSE_CSV: print_csv_head(body, text); return;
  case API_POSE_JSON: print_heading(&body->query, text); break;
  case API_POSE_BIN: {
    uint64_t rows = body->query.times.count * (api_pose_width(body->query.as) * body->query.node_count * 4);
    api_text_add(text, "TWPB");
    print_u32(text, 1);
    print_u32(text, (uint32_t)(body->size - rows - BIN_PREFIX));
    print_heading(&body->query, text);
    print_layout(&body->query, text);
    break;
  }
  }
  api_text_member(text, "times");
  api_text_add(text, "[");
  body->phase = PHASE_TIMES;
}

static void print_times(api_pose_body *body, api_text *text) {
  while (body->next < body->query.times.count && text->size < PIECE) {
    api_text_element(text);
    api_text_float(text, api_times_get(&body->query.times, body->next++));
  }
  if (body->next == body->query.times.count) body->phase = PHASE_OPEN_POSES;
}

static void open_poses(api_pose_body *body, api_text *text) {
  body->next = 0;
  body->phase = PHASE_POSES;
  if (body->query.form == API_POSE_JSON) {
    api_text_add(text, "],\"poses\":[");
    return;
  }
  api_text_add(text, "]}");
  for (uint32_t i = 0; i < body->padding; i++) api_text_add(text, " ");
}

static void print_poses(api_pose_body *body, api_text *text) {
  while (body->next < body->query.times.count && text->size < PIECE) {
    evaluate_pose(body);
    print_pose(body, text);
    body->next++;
  }
  if (body->next == body->query.times.count) body->phase = PHASE_TAIL;
}

/* Prints the next piece into the empty text. */
static void print_piece(api_pose_body *body) {
  api_text *text = &body->text;
  switch (body->phase) {
  case PHASE_HEAD: print_head(body, text); break;
  case PHASE_TIMES: print_times(body, text); break;
  case PHASE_OPEN_POSES: open_poses(body, text); break;
  case PHASE_POSES: print_poses(body, text); break;
  case PHASE_TAIL:
    if (body->query.form == API_POSE_JSON) api_text_add(text, "]}\n");
    body->phase = PHASE_END;
    break;
  case PHASE_END: break;
  }
}

int64_t api_pose_body_read(void *context, uint8_t *out, size_t capacity) {
  api_pose_body *body = context;
  while (body->read == body->text.size && body->phase != PHASE_END) {
    api_text_clear(&body->text);
    body->read = 0;
    print_piece(body);
    if (body->text.failed) return -1;
  }
  size_t left = body->text.size - body->read;
  size_t count = left < capacity ? left : capacity;
  if (count) memcpy(out, body->text.data + body->read, count);
  body->read += count;
  return (int64_t)count;
}

/* ---- making and freeing ------------------------------------------------------------------------- */

static bool allocate(api_pose_body *body, tw_arena *arena) {
  const api_pose_query *query = &body->query;
  uint32_t nodes = query->model->node_count;
  uint64_t times = BLOCK_BYTES / sizeof(tw_trs) / (nodes ? nodes : 1);
  if (times > BLOCK_TIMES) times = BLOCK_TIMES;
  if (times > query->times.count) times = query->times.count;
  body->block_times = times ? (uint32_t)times : 1;
  body->sampled = tw_arena_alloc(arena, body->block_times, sizeof *body->sampled);
  body->locals = tw_arena_alloc(arena, (size_t)body->block_times * nodes, sizeof *body->locals);
  body->row = tw_arena_alloc(arena, query->node_count, api_pose_width(query->as) * sizeof *body->row);
  bool is_whole = body->sampled && body->locals && body->row;
  if (query->as == API_AS_MATRIX || query->is_world) {
    body->matrices = tw_arena_alloc(arena, nodes, 16 * sizeof *body->matrices);
    is_whole = is_whole && body->matrices;
  }
  if (query->is_skinning) {
    body->joints = tw_arena_alloc(arena, query->node_count, 16 * sizeof *body->joints);
    is_whole = is_whole && body->joints;
  }
  if (query->as == API_AS_EULER) {
    body->euler = tw_arena_alloc(arena, query->node_count, sizeof *body->euler);
    is_whole = is_whole && body->euler;
  }
  return is_whole;
}

api_pose_body *api_pose_body_create(const api_pose_query *query, tw_arena *arena) {
  api_pose_body *body = tw_arena_alloc(arena, 1, sizeof *body);
  if (!body) return NULL;
  body->query = *query;
  body->size = API_SIZE_UNKNOWN;
  if (!allocate(body, arena)) return NULL;
  if (query->form != API_POSE_BIN) return body;
  uint64_t header;
  if (!measure_header(query, &header) || header > UINT32_MAX - 4) return NULL;
  body->padding = (uint32_t)((4 - header % 4) % 4);
  body->size = BIN_PREFIX + header + body->padding +
               query->times.count * (api_pose_width(query->as) * query->node_count * sizeof(float));
  return body;
}

void api_pose_body_deinit(api_pose_body *body) {
  api_text_deinit(&body->text);
}

uint64_t api_pose_body_size(const api_pose_body *body) {
  return body->size;
}
