/* Poses on the wire: times are evaluated in small blocks, each pose is printed as it is read. */
#include "pose_body.h"

#include "pose_frame.h"
#include "pose_print.h"

#include <stddef.h>
#include <string.h>

/* Local transforms of one block: enough times at once for the clip's work track by track. */
enum { BLOCK_BYTES = 256 * 1024, BLOCK_TIMES = 64 };

/* A piece of text is printed in steps of about this many bytes. */
enum { PIECE = 32 * 1024 };

/* In a radian. */
static const double DEGREES = 57.295779513082320877;

/* Of the binary form: magic, version, length of the JSON. */
enum { BIN_PREFIX = 12, BIN_LENGTH = 8 };

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
  const api_pose_template *template; /* NULL: nothing is printed yet */
  pose_phase phase;
  uint64_t next; /* time or pose */
  api_text text; /* printed and not yet read */
  size_t read;   /* of text */
  uint64_t size;
  uint32_t padding; /* spaces behind a binary answer's header */

  uint32_t block_times, block_count, block_next;
  float *sampled;    /* [block_times], folded onto the clip */
  tw_trs *locals;    /* [block_times][nodes of the model] */
  bool is_direct;    /* locals are the row itself */
  bool tells_still;  /* what the clip does not change is read from there as well */
  float *matrices;   /* [nodes of the model][16]; NULL where local transforms are told as they are */
  float *lanes;      /* a block of TW_LANES times side by side, in place of locals; NULL: one by one */
  float *lane_world; /* the same block's world matrices */
  float *joints;     /* [node_count][16] with is_skinning */
  float (*euler)[3]; /* [node_count], the pose before; NULL unless asked for */
  bool has_euler;    /* there was a pose before */
  float *row;        /* [node_count][width]; NULL in the binary form */
  float at;          /* of api_pose_body_print */
};

/* ---- evaluating ------------------------------------------------------------------------------- */

static void evaluate_lanes(api_pose_body *body, uint32_t count) {
  const tw_model *model = body->query.model;
  const tw_clip *clip = body->query.clip->compiled;
  for (uint32_t i = count; i < TW_LANES; i++) body->sampled[i] = body->sampled[count - 1];
  tw_clip_lanes(clip, model->nodes, model->node_count, body->sampled, body->lanes);
  tw_lanes_world(clip, model->nodes, model->node_order, model->node_count, body->lanes, body->lane_world);
}

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
  if (body->lanes)
    evaluate_lanes(body, count);
  else
    tw_clip_poses(query->clip->compiled, body->tells_still ? query->clip->rest : NULL, nodes, body->sampled,
                  count, body->locals);
}

/* World matrices of one of the block's poses, of the nodes that the answer tells of. */
static void take_lane(api_pose_body *body, uint32_t lane) {
  for (uint32_t i = 0; i < body->query.node_count; i++) {
    uint32_t node = body->query.nodes[i];
    tw_lanes_matrix(body->lane_world, node, lane, body->matrices + 16 * (size_t)node);
  }
}

/* Matrices of the block's pose `index`: local, or world. */
static void evaluate_matrices(api_pose_body *body, uint32_t index) {
  const tw_model *model = body->query.model;
  const tw_clip *clip = body->query.clip ? body->query.clip->compiled : NULL;
  if (body->lanes) {
    take_lane(body, index);
  } else {
    const tw_trs *locals = body->locals + (size_t)index * model->node_count;
    tw_pose_locals(clip, model->nodes, model->node_count, locals, body->matrices);
    if (body->query.is_world || body->query.is_skinning)
      tw_pose_world(model->nodes, model->node_order, model->node_count, body->matrices, body->matrices);
  }
  float *joints = body->joints;
  for (uint32_t i = 0; joints && i < model->skin_count; i++) {
    tw_skin_matrices(&model->skins[i], body->matrices, joints);
    joints += (size_t)model->skins[i].joint_count * 16;
  }
}

static void put_euler(api_pose_body *body, const tw_trs *local, uint32_t index, float *out) {
  const api_pose_query *query = &body->query;
  float *previous = body->euler[index];
  if (body->has_euler)
    tw_quat_to_euler_near(local->rotation, query->order, previous, out);
  else
    tw_quat_to_euler(local->rotation, query->order, out);
  memcpy(previous, out, sizeof body->euler[index]);
  for (int i = 0; query->in_degrees && i < 3; i++) out[i] = (float)((double)out[i] * DEGREES);
}

/* A transform is told as it is held: see trs_parts. */
_Static_assert(offsetof(tw_trs, rotation) == 0 && offsetof(tw_trs, translation) == 4 * sizeof(float) &&
                   offsetof(tw_trs, scale) == 7 * sizeof(float) && sizeof(tw_trs) == 10 * sizeof(float),
               "rotation, translation and scale, without gaps");

/* One node's numbers, as api_pose_parts orders them. */
static void put_node(api_pose_body *body, const tw_trs *local, uint32_t index, float *out) {
  const api_pose_query *query = &body->query;
  switch (query->as) {
  case API_AS_MATRIX: return;
  case API_AS_TRS: memcpy(out, local, sizeof *local); return;
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

/* The block's pose `index` by matrices. */
static void put_matrices(api_pose_body *body, uint32_t index, float *out) {
  const api_pose_query *query = &body->query;
  evaluate_matrices(body, index);
  for (uint32_t i = 0; i < query->node_count; i++, out += api_pose_width(query->as)) {
    const float *matrix = body->matrices + (size_t)query->nodes[i] * 16;
    if (query->as == API_AS_MATRIX) {
      memcpy(out, body->joints ? body->joints + (size_t)i * 16 : matrix, 16 * sizeof *out);
    } else {
      tw_trs world;
      tw_trs_from_matrix(matrix, &world); /* shear has no place in it */
      put_node(body, &world, i, out);
    }
  }
}

/* Fills a row with the next pose. */
static void evaluate_pose(api_pose_body *body, float *row) {
  const api_pose_query *query = &body->query;
  if (body->is_direct) body->locals = (tw_trs *)(void *)row;
  if (body->block_next == body->block_count) evaluate_block(body);
  uint32_t index = body->block_next++, count = query->node_count;
  const tw_trs *locals = body->locals + (size_t)index * query->model->node_count;
  if (body->matrices)
    put_matrices(body, index, row);
  else if (!body->is_direct)
    for (uint32_t i = 0; i < count; i++)
      put_node(body, &locals[query->nodes[i]], i, row + i * api_pose_width(query->as));
  body->has_euler = true;
}

/* ---- phases ------------------------------------------------------------------------------------ */

/* What comes before the times, or before the poses where the form has none. */
static void print_opening(const api_pose_query *query, api_text *text) {
  switch (query->form) {
  case API_POSE_NDJSON: return;
  case API_POSE_CSV: api_pose_print_columns(query, text); return;
  case API_POSE_BIN:
    api_text_add(text, "TWPB");
    api_pose_print_u32(1, text);
    api_pose_print_u32(0, text); /* the length: see print_bin_head */
    api_pose_print_heading(query, text);
    api_pose_print_layout(query, text);
    break;
  case API_POSE_JSON: api_pose_print_heading(query, text); break;
  }
  api_text_member(text, "times");
  api_text_add(text, "[");
}

static void print_head(api_pose_body *body, api_text *text) {
  const api_pose_template *template = body->template;
  body->phase = body->query.form == API_POSE_JSON ? PHASE_TIMES : PHASE_POSES;
  if (template)
    api_text_bytes(text, template->opening, template->opening_size);
  else
    print_opening(&body->query, text);
}

/* The size of the whole answer stands in a binary one's head, which is printed first. False when there is no
 * memory or the header is too long. */
static bool print_bin_head(api_pose_body *body) {
  const api_pose_query *query = &body->query;
  api_text *text = &body->text;
  if (body->template) api_text_reserve(text, body->template->size); /* for the poses as well */
  print_head(body, text);
  uint64_t header = text->size - BIN_PREFIX + api_pose_measure_times(query) + strlen("]}");
  if (text->failed || header > UINT32_MAX - 4) return false;
  body->padding = (uint32_t)((4 - header % 4) % 4);
  header += body->padding;
  for (int i = 0; i < 4; i++) text->data[BIN_LENGTH + i] = (char)(header >> 8 * i & 0xFF);
  body->size = BIN_PREFIX + header +
               query->times.count * (api_pose_width(query->as) * query->node_count * sizeof(float));
  body->phase = PHASE_TIMES;
  return true;
}

static void print_times(api_pose_body *body, api_text *text) {
  size_t end = text->size + PIECE;
  while (body->next < body->query.times.count && text->size < end && !text->failed) {
    api_text_element(text);
    api_times_print_one(&body->query.times, body->next++, text);
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

static void print_pose(api_pose_body *body, api_text *text) {
  const api_pose_query *query = &body->query;
  size_t count = api_pose_width(query->as) * query->node_count;
  bool is_binary = query->form == API_POSE_BIN;
  float *row = is_binary ? api_text_room(text, count) : body->row;
  if (!row) return;
  evaluate_pose(body, row);
  if (is_binary)
    api_text_room_filled(row, count);
  else
    api_pose_print_row(query, body->next, row, body->template ? &body->template->frame : NULL, text);
}

static void print_poses(api_pose_body *body, api_text *text) {
  size_t end = text->size + PIECE;
  for (; body->next < body->query.times.count && text->size < end && !text->failed; body->next++)
    print_pose(body, text);
  if (body->next == body->query.times.count) body->phase = PHASE_TAIL;
}

static void print_piece(api_pose_body *body, api_text *text) {
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
    print_piece(body, &body->text);
    if (body->text.failed) return -1;
  }
  size_t left = body->text.size - body->read;
  size_t count = left < capacity ? left : capacity;
  if (count) memcpy(out, body->text.data + body->read, count);
  body->read += count;
  return (int64_t)count;
}

void api_pose_body_print_whole(api_pose_body *body, api_text *text) {
  *text = body->text; /* the head of the binary form */
  body->text = (api_text){0};
  uint64_t size = body->template ? body->template->size : 0;
  if (body->size != API_SIZE_UNKNOWN) size = body->size - text->size;
  if (size <= SIZE_MAX) api_text_reserve(text, (size_t)size);
  while (body->phase != PHASE_END && !text->failed) print_piece(body, text);
}

bool api_pose_body_print(api_pose_body *body, float time, api_text *text) {
  body->at = time;
  body->query.times = (api_times){.is_given = true, .count = 1, .list = &body->at};
  body->next = 0;
  body->block_next = body->block_count = 0;
  evaluate_pose(body, body->row);
  api_pose_print_row(&body->query, 0, body->row, NULL, text);
  return !text->failed;
}

/* ---- making and freeing ------------------------------------------------------------------------- */

/* Whether lanes give what poses one by one give, and sooner: in world space, and unless a matrix has a last
 * row, which lanes do not hold, the block is larger than the cache, or there are fewer times than lanes. */
static bool lanes_serve(const api_pose_query *query) {
  enum { NODES_MOST = 1024 };
  const tw_model *model = query->model;
  bool is_world = query->is_world || query->is_skinning;
  if (!query->clip || !is_world || query->times.count < TW_LANES || model->node_count > NODES_MOST)
    return false;
  for (uint32_t i = 0; i < model->node_count; i++) {
    const float *m = model->nodes[i].matrix;
    if (model->nodes[i].has_matrix && (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)) return false;
  }
  return true;
}

static bool allocate_block(api_pose_body *body, tw_arena *arena) {
  const api_pose_query *query = &body->query;
  uint32_t nodes = query->model->node_count;
  if (lanes_serve(query)) {
    body->block_times = TW_LANES;
    body->sampled = tw_arena_alloc_raw(arena, TW_LANES, sizeof *body->sampled);
    body->lanes = tw_arena_alloc_raw(arena, nodes, sizeof(float[TW_LANE_TRS][TW_LANES]));
    body->lane_world = tw_arena_alloc_raw(arena, nodes, sizeof(float[TW_LANE_MATRIX][TW_LANES]));
    return body->sampled && body->lanes && body->lane_world;
  }
  uint64_t times = BLOCK_BYTES / sizeof(tw_trs) / (nodes ? nodes : 1);
  if (times > BLOCK_TIMES) times = BLOCK_TIMES;
  if (times > query->times.count) times = query->times.count;
  body->block_times = times ? (uint32_t)times : 1;
  body->sampled = tw_arena_alloc_raw(arena, body->block_times, sizeof *body->sampled);
  /* One pose of all nodes, told as it is held, is evaluated where it is told from. */
  body->is_direct =
      body->block_times == 1 && query->as == API_AS_TRS && !query->is_world && api_pose_has_all_nodes(query);
  const api_pose_frame *frame = body->template ? &body->template->frame : NULL;
  body->tells_still = !body->is_direct || !frame || !frame->text || frame->has_still;
  if (body->is_direct) return body->sampled;
  body->locals = tw_arena_alloc_raw(arena, (size_t)body->block_times * nodes, sizeof *body->locals);
  return body->sampled && body->locals;
}

static bool allocate(api_pose_body *body, tw_arena *arena) {
  const api_pose_query *query = &body->query;
  uint32_t nodes = query->model->node_count;
  bool is_whole = allocate_block(body, arena);
  if (query->form != API_POSE_BIN) {
    body->row = tw_arena_alloc_raw(arena, query->node_count, api_pose_width(query->as) * sizeof *body->row);
    is_whole = is_whole && body->row;
  }
  if (query->as == API_AS_MATRIX || query->is_world) {
    body->matrices = tw_arena_alloc_raw(arena, nodes, 16 * sizeof *body->matrices);
    is_whole = is_whole && body->matrices;
  }
  if (query->is_skinning) {
    body->joints = tw_arena_alloc_raw(arena, query->node_count, 16 * sizeof *body->joints);
    is_whole = is_whole && body->joints;
  }
  if (query->as == API_AS_EULER) {
    body->euler = tw_arena_alloc_raw(arena, query->node_count, sizeof *body->euler);
    is_whole = is_whole && body->euler;
  }
  return is_whole;
}

bool api_pose_template_take(const api_pose_body *body, size_t size, tw_arena *arena, api_pose_template *out) {
  const api_pose_query *query = &body->query;
  api_text text = {0};
  print_opening(query, &text);
  const char *opening = text.failed ? NULL : tw_arena_text(arena, text.data, text.size);
  /* Some numbers of other times are longer, few by much, and most are as long; but while they are printed,
   * each piece is given the room that it might need. */
  *out = (api_pose_template){.opening = opening, .opening_size = text.size, .size = size + size / 16 + 1200};
  api_text_deinit(&text);
  bool is_json = query->form == API_POSE_JSON || query->form == API_POSE_NDJSON;
  return opening && (!is_json || api_pose_frame_take(query, body->row, arena, &out->frame));
}

api_pose_body *api_pose_body_create(const api_pose_query *query, const api_pose_template *template,
                                    tw_arena *arena, api_room room) {
  api_pose_body *body = tw_arena_alloc(arena, 1, sizeof *body);
  if (!body) return NULL;
  body->query = *query;
  body->template = template;
  body->size = API_SIZE_UNKNOWN;
  if (room.data)
    body->text = (api_text){.data = (char *)room.data, .capacity = room.capacity, .in_room = true};
  if (!allocate(body, arena)) return NULL;
  if (query->form != API_POSE_BIN || print_bin_head(body)) return body;
  api_text_deinit(&body->text);
  return NULL;
}

void api_pose_body_deinit(api_pose_body *body) {
  api_text_deinit(&body->text);
}

uint64_t api_pose_body_size(const api_pose_body *body) {
  return body->size;
}
