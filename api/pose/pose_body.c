/* Evaluates poses one by one and prints them as JSON, lines of JSON, CSV or binary rows. */
#include "pose_body.h"

#include "node_names.h"
#include "service.h"

#include <stdio.h>
#include <string.h>

/* Text is printed in steps of about this many bytes, poses in steps of about as many transforms. */
enum { PIECE = 32 * 1024, PIECE_TRANSFORMS = 1 << 16 };

/* About the bytes of an answer beside its numbers: once, and for each node. */
enum { HEAD_BYTES = 500, NAME_BYTES = 16 };

/* Binary form: bytes of magic, version and length of the JSON; offset of that length. */
enum { BIN_PREFIX = 12, BIN_LENGTH = 8 };

/* The part of the answer that is printed next. */
typedef enum pose_phase { PHASE_HEAD, PHASE_TIMES, PHASE_POSES, PHASE_END } pose_phase;

struct api_pose_body {
  api_pose_request request; /* holds the entries */
  api_service *service;
  pose_phase phase;
  uint64_t next;    /* index of the next time or pose */
  tw_text text;     /* text printed last */
  size_t read;      /* bytes of text read so far */
  uint64_t size;    /* of the whole answer */
  uint32_t padding; /* spaces behind a binary answer's header */

  tw_trs *locals;    /* [nodes of the model]; NULL where a row is the local transforms */
  float *matrices;   /* [nodes of the model][16], local or world; NULL where no matrix is needed */
  float *joints;     /* [node_count][16] joint matrices; NULL unless is_skinning */
  float (*euler)[3]; /* [node_count], of the previous pose; NULL unless asked for */
  bool has_euler;    /* there is a previous pose */
  float *row;        /* [node_count][width]; NULL in the binary form */

  uint32_t weight_count; /* tracks of morph weights of the answer's nodes */
  uint32_t *weights;     /* [weight_count] */
  float *sample;         /* of the widest of these */
};

/* A part of a node's numbers. */
typedef struct pose_part {
  const char *name;
  uint32_t offset, width; /* floats; offset from the node's first float */
} pose_part;

/* The layout of a node's numbers in a pose. */
typedef struct pose_layout {
  const char *name;
  uint32_t width;      /* floats of a node */
  pose_part parts[4];  /* in the order of the answer; the last has no name */
  const char *columns; /* the columns in CSV */
  const char *members; /* the parts in the header of the binary form */
} pose_layout;

#define MOVED_COLUMNS "translation_x,translation_y,translation_z,scale_x,scale_y,scale_z"

/* By api_pose_as. */
static const pose_layout layouts[] = {
    {"trs",
     10,
     {{"rotation", 0, 4}, {"translation", 4, 3}, {"scale", 7, 3}},
     "rotation_x,rotation_y,rotation_z,rotation_w," MOVED_COLUMNS,
     "{\"name\":\"rotation\",\"offset\":0,\"byte_offset\":0,\"components\":4},"
     "{\"name\":\"translation\",\"offset\":4,\"byte_offset\":16,\"components\":3},"
     "{\"name\":\"scale\",\"offset\":7,\"byte_offset\":28,\"components\":3}"},
    {"matrix",
     16,
     {{"matrix", 0, 16}},
     "m0,m1,m2,m3,m4,m5,m6,m7,m8,m9,m10,m11,m12,m13,m14,m15",
     "{\"name\":\"matrix\",\"offset\":0,\"byte_offset\":0,\"components\":16}"},
    {"euler",
     9,
     {{"euler", 0, 3}, {"translation", 3, 3}, {"scale", 6, 3}},
     "euler_x,euler_y,euler_z," MOVED_COLUMNS,
     "{\"name\":\"euler\",\"offset\":0,\"byte_offset\":0,\"components\":3},"
     "{\"name\":\"translation\",\"offset\":3,\"byte_offset\":12,\"components\":3},"
     "{\"name\":\"scale\",\"offset\":6,\"byte_offset\":24,\"components\":3}"},
    {"axis-angle",
     10,
     {{"axis_angle", 0, 4}, {"translation", 4, 3}, {"scale", 7, 3}},
     "axis_x,axis_y,axis_z,angle," MOVED_COLUMNS,
     "{\"name\":\"axis_angle\",\"offset\":0,\"byte_offset\":0,\"components\":4},"
     "{\"name\":\"translation\",\"offset\":4,\"byte_offset\":16,\"components\":3},"
     "{\"name\":\"scale\",\"offset\":7,\"byte_offset\":28,\"components\":3}"},
};

/* Numbers of one node in a pose. */
static size_t node_width(api_pose_as as) {
  return layouts[as].width;
}

/* Numbers of a root motion: its rotation and translation. */
enum { ROOT_WIDTH = 7 };

/* Morph weights in a row: text has them beside it. */
static size_t row_weights(const api_pose_request *request) {
  return request->form == API_POSE_BIN ? (size_t)request->weights : 0;
}

/* Numbers of a row: those of nodes, then morph weights, then the root motion where it has any. */
static size_t row_width(const api_pose_request *request) {
  return node_width(request->as) * request->node_count + row_weights(request) +
         (api_pose_has_root(request) ? ROOT_WIDTH : 0);
}

uint64_t api_pose_numbers(const api_pose_request *request) {
  uint64_t numbers = row_width(request) - row_weights(request) + request->weights;
  return numbers ? numbers : 1;
}

/* ---- evaluating ------------------------------------------------------------------------------ */

static void evaluate_locals(const api_pose_request *request, double time, tw_trs *locals) {
  const tw_model *model = request->model;
  if (!request->clip) {
    for (uint32_t i = 0; i < model->node_count; i++) locals[i] = model->nodes[i].rest;
    return;
  }
  float looped = tw_loop_time(time, request->clip->duration, request->loop);
  tw_clip_pose(request->clip->compiled, model->nodes, model->node_count, looped, locals);
}

/* Computes the matrices of the local transforms: local, world, or of joints. */
static void evaluate_matrices(api_pose_body *body) {
  const api_pose_request *request = &body->request;
  const tw_model *model = request->model;
  const tw_clip *clip = request->clip ? request->clip->compiled : NULL;
  tw_pose_locals(clip, model->nodes, model->node_count, body->locals, body->matrices);
  if (request->is_world || request->is_skinning)
    tw_pose_world(model->nodes, model->node_order, model->node_count, body->matrices, body->matrices);
  float *joints = body->joints;
  for (uint32_t i = 0; joints && i < model->skin_count; i++) {
    tw_skin_matrices(&model->skins[i], body->matrices, joints);
    joints += (size_t)model->skins[i].joint_count * 16;
  }
}

static void put_euler(api_pose_body *body, const tw_trs *transform, uint32_t index, float *out) {
  const api_pose_request *request = &body->request;
  float *previous = body->euler[index];
  if (body->has_euler)
    tw_quat_to_euler_near(transform->rotation, request->order, previous, out);
  else
    tw_quat_to_euler(transform->rotation, request->order, out);
  memcpy(previous, out, sizeof body->euler[index]);
  for (int i = 0; request->in_degrees && i < 3; i++) out[i] = (float)((double)out[i] * TW_DEGREES);
}

/* Writes the numbers of the answer's node `index` in the order of its layout. */
static void put_transform(api_pose_body *body, const tw_trs *transform, uint32_t index, float *out) {
  const api_pose_request *request = &body->request;
  switch (request->as) {
  case API_AS_MATRIX: return;
  case API_AS_TRS: memcpy(out, transform, sizeof *transform); return;
  case API_AS_EULER:
    put_euler(body, transform, index, out);
    out += 3;
    break;
  case API_AS_AXIS_ANGLE:
    tw_quat_to_axis_angle(transform->rotation, out);
    if (request->in_degrees) out[3] = (float)((double)out[3] * TW_DEGREES);
    out += 4;
    break;
  }
  memcpy(out, transform->translation, sizeof transform->translation);
  memcpy(out + 3, transform->scale, sizeof transform->scale);
}

static void put_node(api_pose_body *body, uint32_t index, float *out) {
  const api_pose_request *request = &body->request;
  uint32_t node = request->nodes[index];
  const float *matrix = body->matrices ? body->matrices + (size_t)node * 16 : NULL;
  if (request->as == API_AS_MATRIX) {
    memcpy(out, body->joints ? body->joints + (size_t)index * 16 : matrix, 16 * sizeof *out);
  } else if (body->matrices) {
    tw_trs world;
    tw_trs_from_matrix(matrix, &world); /* the nearest TRS, which cannot shear */
    put_transform(body, &world, index, out);
  } else {
    put_transform(body, &body->locals[node], index, out);
  }
}

/* Writes the morph weights of a row. */
static void put_weights(const api_pose_body *body, double time, float *out) {
  const api_pose_request *request = &body->request;
  const tw_clip *clip = request->clip->compiled;
  float looped = tw_loop_time(time, request->clip->duration, request->loop);
  for (uint32_t i = 0; i < body->weight_count; i++) {
    tw_clip_sample(clip, body->weights[i], &looped, 1, out);
    out += tw_clip_width(clip, body->weights[i]);
  }
}

/* Fills a row with the pose at a time. A row that is just the local transforms is evaluated in place, which
 * saves a third of the time of binary rows. */
static void evaluate(api_pose_body *body, double time, float *row) {
  const api_pose_request *request = &body->request;
  if (row_weights(request) > 0) put_weights(body, time, row + node_width(request->as) * request->node_count);
  if (api_pose_has_root(request)) {
    tw_trs root;
    tw_clip_root_at(request->clip->compiled, tw_loop_time(time, request->clip->duration, request->loop),
                    &root);
    memcpy(row + row_width(request) - ROOT_WIDTH, &root, ROOT_WIDTH * sizeof *row);
  }
  evaluate_locals(request, time, body->locals ? body->locals : (tw_trs *)(void *)row);
  if (!body->locals) return;
  if (body->matrices) evaluate_matrices(body);
  size_t width = node_width(request->as);
  for (uint32_t i = 0; i < request->node_count; i++) put_node(body, i, row + i * width);
  body->has_euler = true;
}

/* ---- the answer's header --------------------------------------------------------------------- */

static void print_node_names(const api_pose_request *request, tw_text *text) {
  tw_text_member(text, "nodes");
  if (request->clip && api_pose_has_all_nodes(request))
    tw_text_add(text, request->clip->node_names);
  else
    api_node_names_print(request->model, request->nodes, request->node_count, text);
}

/* Prints the range of joints of each skin. */
static void print_skins(const tw_model *model, tw_text *text) {
  uint64_t first = 0;
  tw_member_open(text, "skins", "[");
  for (uint32_t i = 0; i < model->skin_count; i++) {
    const tw_skin *skin = &model->skins[i];
    tw_text_element(text);
    tw_text_add(text, "{");
    tw_member_string(text, "name", skin->name);
    tw_member_count(text, "first", first);
    tw_member_count(text, "count", skin->joint_count);
    tw_text_add(text, "}");
    first += skin->joint_count;
  }
  tw_text_add(text, "]");
}

static void print_warnings(const api_clip *clip, tw_text *text) {
  tw_member_open(text, "warnings", "[");
  for (uint32_t i = 0; i < clip->warning_count; i++) {
    tw_text_element(text);
    tw_text_string(text, clip->warnings[i]);
  }
  tw_text_add(text, "]");
}

/* Prints the members that describe the answer; leaves the object open. */
static void print_heading(const api_pose_request *request, tw_text *text) {
  const api_clip *clip = request->clip;
  tw_text_add(text, "{");
  tw_member_string(text, "clip", clip ? clip->name : NULL);
  tw_member_float(text, "duration", clip ? (float)clip->duration : 0);
  tw_member_string(text, "space", request->is_world ? "world" : "local");
  tw_member_string(text, "as", layouts[request->as].name);
  if (request->as == API_AS_EULER) {
    tw_member_string(text, "order", tw_euler_order_names[request->order]);
  }
  if (request->as == API_AS_EULER || request->as == API_AS_AXIS_ANGLE) {
    tw_member_string(text, "unit", request->in_degrees ? "degrees" : "radians");
  }
  if (clip && clip->warning_count > 0) print_warnings(clip, text);
  print_node_names(request, text);
  if (request->is_skinning) print_skins(request->model, text);
}

/* The name by which weights are told: that of a node's own, or `node_3` where an earlier node has it. */
static const char *weights_name(const tw_model *model, uint32_t node, char buffer[24]) {
  const uint32_t *all;
  if (tw_model_namesakes(model, node, &all) < 2 || all[0] == node)
    return tw_model_node_name(model, node, buffer);
  snprintf(buffer, 24, "node_%u", node);
  return buffer;
}

/* Prints where a part is, in floats and bytes. */
static void print_place(size_t offset, size_t components, tw_text *text) {
  tw_member_count(text, "offset", offset);
  tw_member_count(text, "byte_offset", offset * sizeof(float));
  tw_member_count(text, "components", components);
}

/* Prints where morph weights are in a row. node: the place in the answer's nodes, for names may be shared. */
static void print_weights_layout(const api_pose_body *body, tw_text *text) {
  const api_pose_request *request = &body->request;
  const tw_clip *clip = request->clip->compiled;
  size_t offset = node_width(request->as) * request->node_count;
  tw_member_open(text, "weights", "[");
  for (uint32_t i = 0; i < body->weight_count; i++) {
    char buffer[24];
    tw_path path;
    uint32_t track = body->weights[i], node = tw_clip_target(clip, track, &path);
    uint32_t width = tw_clip_width(clip, track);
    tw_text_element(text);
    tw_text_add(text, "{");
    tw_member_string(text, "name", weights_name(request->model, node, buffer));
    tw_member_count(text, "node", api_pose_place(request, node));
    print_place(offset, width, text);
    tw_text_add(text, "}");
    offset += width;
  }
  tw_text_add(text, "]");
}

/* Prints where a node's numbers are in a row of the binary form. */
static void print_layout(const api_pose_body *body, tw_text *text) {
  const api_pose_request *request = &body->request;
  tw_member_count(text, "poses", request->times.count);
  tw_member_count(text, "stride", row_width(request));
  tw_member_count(text, "node_stride", node_width(request->as));
  if (row_weights(request) > 0) print_weights_layout(body, text);
  if (api_pose_has_root(request)) {
    size_t offset = row_width(request) - ROOT_WIDTH;
    tw_member_open(text, "root", "[{\"name\":\"rotation\"");
    print_place(offset, 4, text);
    tw_text_add(text, "},{\"name\":\"translation\"");
    print_place(offset + 4, 3, text);
    tw_text_add(text, "}]");
  }
  tw_member_open(text, "layout", "[");
  tw_text_add(text, layouts[request->as].members);
  tw_text_add(text, "]");
}

/* ---- poses ----------------------------------------------------------------------------------- */

/* Prints the morph weights by node, where the clip moves any. */
static void print_weights(const api_pose_body *body, double time, tw_text *text) {
  const api_pose_request *request = &body->request;
  if (body->weight_count == 0) return;
  const tw_clip *clip = request->clip->compiled;
  float looped = tw_loop_time(time, request->clip->duration, request->loop);
  tw_member_open(text, "weights", "{");
  for (uint32_t i = 0; i < body->weight_count; i++) {
    char buffer[24];
    tw_path path;
    uint32_t track = body->weights[i];
    tw_clip_sample(clip, track, &looped, 1, body->sample);
    tw_member_floats(text, weights_name(request->model, tw_clip_target(clip, track, &path), buffer),
                     body->sample, tw_clip_width(clip, track));
  }
  tw_text_add(text, "}");
}

static void print_json_pose(const api_pose_body *body, double time, const float *row, tw_text *text) {
  const api_pose_request *request = &body->request;
  size_t width = node_width(request->as);
  tw_text_add(text, "{\"t\":");
  tw_text_double(text, time);
  for (const pose_part *part = layouts[request->as].parts; part->name; part++) {
    tw_member_open(text, part->name, "[");
    tw_text_vectors(text, row + part->offset, width, part->width, request->node_count);
    tw_text_add(text, "]");
  }
  print_weights(body, time, text);
  if (api_pose_has_root(request)) {
    const float *root = row + row_width(request) - ROOT_WIDTH;
    tw_member_open(text, "root", "{");
    tw_member_floats(text, "translation", root + 4, 3);
    tw_member_floats(text, "rotation", root, 4);
    tw_text_add(text, "}");
  }
  tw_text_add(text, "}");
}

/* A CSV field, quoted where RFC 4180 asks for it. */
static void print_csv_text(tw_text *text, const char *value) {
  if (!value[strcspn(value, ",\"\r\n")]) {
    tw_text_add(text, value);
    return;
  }
  tw_text_add(text, "\"");
  for (; *value; value++) {
    if (*value == '"') tw_text_add(text, "\"");
    tw_text_bytes(text, value, 1);
  }
  tw_text_add(text, "\"");
}

static void print_csv_pose(const api_pose_request *request, double time, const float *row, tw_text *text) {
  char number[TW_NUMBER_TEXT], buffer[24];
  size_t width = node_width(request->as), digits = tw_print_double(number, time);
  for (uint32_t i = 0; i < request->node_count; i++) {
    tw_text_bytes(text, number, digits);
    tw_text_add(text, ",");
    print_csv_text(text, tw_model_node_name(request->model, request->nodes[i], buffer));
    size_t bracket = text->size; /* JSON's brackets become a comma and the end of the line */
    tw_text_vectors(text, row + i * width, width, width, 1);
    if (text->failed) return;
    text->data[bracket] = ',';
    text->data[text->size - 1] = '\r';
    tw_text_add(text, "\n");
  }
}

static void print_pose(api_pose_body *body, double time, tw_text *text) {
  const api_pose_request *request = &body->request;
  size_t count = row_width(request);
  bool is_binary = request->form == API_POSE_BIN;
  float *row = is_binary ? tw_text_room(text, count) : body->row;
  if (!row) return;
  evaluate(body, time, row);
  switch (request->form) {
  case API_POSE_JSON:
    tw_text_element(text);
    print_json_pose(body, time, row, text);
    break;
  case API_POSE_NDJSON:
    print_json_pose(body, time, row, text);
    tw_text_add(text, "\n");
    break;
  case API_POSE_BIN: tw_text_room_filled(row, count); break;
  case API_POSE_CSV: print_csv_pose(request, time, row, text); break;
  }
}

static void count_poses(api_pose_body *body, uint64_t count) {
  atomic_fetch_add(&body->service->joint_times, count * body->request.model->node_count);
}

void api_pose_body_print_at(api_pose_body *body, double time, tw_text *text) {
  print_pose(body, time, text);
  count_poses(body, 1);
}

/* ---- phases ---------------------------------------------------------------------------------- */

static void print_head(api_pose_body *body, tw_text *text) {
  const api_pose_request *request = &body->request;
  switch (request->form) {
  case API_POSE_NDJSON: body->phase = PHASE_POSES; return;
  case API_POSE_CSV:
    tw_text_add(text, "t,node,");
    tw_text_add(text, layouts[request->as].columns);
    tw_text_add(text, "\r\n");
    body->phase = PHASE_POSES;
    return;
  case API_POSE_BIN:
    tw_text_bytes(text, "TWPB\1\0\0\0\0\0\0\0", BIN_PREFIX); /* print_bin_head fills in the length */
    print_heading(request, text);
    print_layout(body, text);
    break;
  case API_POSE_JSON: print_heading(request, text); break;
  }
  tw_member_open(text, "times", "[");
  body->phase = PHASE_TIMES;
}

/* The bytes of the times in a list. */
static uint64_t measure_times(const api_times *times) {
  char number[TW_NUMBER_TEXT];
  uint64_t size = times->count > 0 ? times->count - 1 : 0;
  for (uint64_t i = 0; i < times->count; i++) size += tw_print_double(number, api_times_get(times, i));
  return size;
}

/* Prints the header of a binary answer with its length, which gives the size of the answer. False without
 * memory or when the header is too long. */
static bool print_bin_head(api_pose_body *body) {
  const api_pose_request *request = &body->request;
  tw_text *text = &body->text;
  uint64_t row = row_width(request) * sizeof(float);
  uint64_t rows = request->times.count * row;
  tw_text_reserve(text, HEAD_BYTES + NAME_BYTES * (size_t)request->node_count +
                            (size_t)(rows < PIECE ? rows : PIECE));
  print_head(body, text);
  uint64_t header = text->size - BIN_PREFIX + measure_times(&request->times) + strlen("]}");
  if (text->failed || header > UINT32_MAX - 4) return false;
  body->padding = (uint32_t)((4 - header % 4) % 4);
  header += body->padding;
  tw_put_u32((uint8_t *)text->data + BIN_LENGTH, header);
  body->size = BIN_PREFIX + header + rows;
  return true;
}

static void close_times(api_pose_body *body, tw_text *text) {
  if (body->request.form == API_POSE_JSON) {
    tw_text_add(text, "],\"poses\":[");
  } else {
    tw_text_add(text, "]}");
    for (uint32_t i = 0; i < body->padding; i++) tw_text_add(text, " ");
  }
  body->next = 0;
  body->phase = PHASE_POSES;
}

static void close_poses(api_pose_body *body, tw_text *text) {
  if (body->request.form == API_POSE_JSON) tw_text_add(text, "]}\n");
  body->phase = PHASE_END;
}

/* Prints poses up to `end` of the text, fewer where they take much work. Fails where they are not wanted any
 * more. */
static void print_poses(api_pose_body *body, size_t end, tw_text *text) {
  enum { STEPS = 4 };
  const api_times *times = &body->request.times;
  uint64_t first = body->next, each = api_pose_transforms(&body->request), work = 0;
  for (; body->next < times->count && text->size < end && work < PIECE_TRANSFORMS && !text->failed;
       body->next++, work += each) {
    print_pose(body, api_times_get(times, body->next), text);
    if (!tw_work(STEPS * each)) text->failed = true;
  }
  count_poses(body, body->next - first);
}

/* Prints about a piece, or up to the end of the phase. */
static void print_piece(api_pose_body *body, tw_text *text) {
  const api_times *times = &body->request.times;
  size_t end = text->size + PIECE;
  switch (body->phase) {
  case PHASE_HEAD: print_head(body, text); break;
  case PHASE_TIMES:
    for (; body->next < times->count && text->size < end && !text->failed; body->next++) {
      tw_text_element(text);
      tw_text_double(text, api_times_get(times, body->next));
    }
    if (body->next == times->count) close_times(body, text);
    break;
  case PHASE_POSES:
    print_poses(body, end, text);
    if (body->next == times->count) close_poses(body, text);
    break;
  case PHASE_END: break;
  }
}

int64_t api_pose_body_read(void *context, uint8_t *out, size_t capacity) {
  api_pose_body *body = context;
  while (body->read == body->text.size && body->phase != PHASE_END) {
    tw_text_clear(&body->text);
    body->read = 0;
    print_piece(body, &body->text);
    if (body->text.failed) return -1;
  }
  size_t left = body->text.size - body->read, count = left < capacity ? left : capacity;
  if (count) memcpy(out, body->text.data + body->read, count);
  body->read += count;
  return (int64_t)count;
}

void api_pose_body_print_all(api_pose_body *body, tw_text *text) {
  const api_pose_request *request = &body->request;
  size_t numbers = (size_t)(request->times.count * api_pose_numbers(request));
  size_t likely = HEAD_BYTES + NAME_BYTES * (size_t)request->node_count + numbers * API_POSE_NUMBER_BYTES;
  *text = body->text; /* the header in the binary form, else empty */
  body->text = (tw_text){0};
  tw_text_reserve(text, body->size == API_SIZE_UNKNOWN ? likely : (size_t)body->size - text->size);
  while (body->phase != PHASE_END && !text->failed) print_piece(body, text);
}

/* ---- making and freeing ---------------------------------------------------------------------- */

/* A row of local transforms is an array of tw_trs. */
_Static_assert(offsetof(tw_trs, rotation) == 0 && offsetof(tw_trs, translation) == 4 * sizeof(float) &&
                   offsetof(tw_trs, scale) == 7 * sizeof(float) && sizeof(tw_trs) == 10 * sizeof(float),
               "rotation, translation and scale, without gaps");

/* [count][width] floats. NULL where they are not needed, or without memory, which clears *has_all. */
static void *allocate(tw_arena *arena, bool is_needed, uint32_t count, size_t width, bool *has_all) {
  if (!is_needed) return NULL;
  void *memory = tw_arena_alloc_raw(arena, count, width * sizeof(float));
  *has_all = *has_all && memory;
  return memory;
}

/* Finds the tracks of morph weights that the answer tells. False without memory. */
static bool find_weights(api_pose_body *body, tw_arena *arena) {
  const api_pose_request *request = &body->request;
  const tw_clip *clip = request->clip ? request->clip->compiled : NULL;
  if (!clip || request->weights == 0) return true;
  uint32_t tracks = tw_clip_track_count(clip), widest = 0;
  for (uint32_t pass = 0; pass < 2; pass++) { /* counts, then lists */
    uint32_t count = 0;
    for (uint32_t i = 0; i < tracks; i++) {
      uint32_t width = tw_clip_width(clip, i);
      if (!api_pose_tells_weights(request, i)) continue;
      if (pass == 1) body->weights[count] = i;
      count++;
      if (width > widest) widest = width;
    }
    if (pass == 1 || count == 0) return true;
    body->weight_count = count;
    body->weights = tw_arena_alloc_raw(arena, count, sizeof *body->weights);
    body->sample = tw_arena_alloc_raw(arena, widest, sizeof *body->sample);
    if (!body->weights || !body->sample) return false;
  }
  return true;
}

api_pose_body *api_pose_body_create(api_pose_request *request, api_service *service, tw_arena *arena) {
  api_pose_body *body = tw_arena_alloc(arena, 1, sizeof *body);
  if (!body) return NULL;
  body->request = *request;
  body->service = service;
  body->size = API_SIZE_UNKNOWN;
  uint32_t nodes = request->model->node_count, count = request->node_count;
  bool has_matrices = request->as == API_AS_MATRIX || request->is_world, has_all = true;
  bool is_direct = request->as == API_AS_TRS && !has_matrices && api_pose_has_all_nodes(request);
  body->locals = allocate(arena, !is_direct, nodes, sizeof(tw_trs) / sizeof(float), &has_all);
  body->matrices = allocate(arena, has_matrices, nodes, 16, &has_all);
  body->joints = allocate(arena, request->is_skinning, count, 16, &has_all);
  body->euler = allocate(arena, request->as == API_AS_EULER, count, 3, &has_all);
  body->row = allocate(arena, request->form != API_POSE_BIN, 1, row_width(request), &has_all);
  has_all = has_all && find_weights(body, arena);
  if (has_all && (request->form != API_POSE_BIN || print_bin_head(body))) {
    request->model_entry = request->clip_entry = NULL;
    return body;
  }
  tw_text_deinit(&body->text);
  return NULL;
}

void api_pose_body_destroy(void *context) {
  api_pose_body *body = context;
  if (!body) return;
  tw_text_deinit(&body->text);
  api_pose_request_deinit(&body->request);
}

uint64_t api_pose_body_size(const api_pose_body *body) {
  return body->size;
}
