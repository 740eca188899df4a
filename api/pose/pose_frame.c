/* Which numbers a clip changes is known from its tracks: all others are printed with the frame. */
#include "pose_frame.h"

#include "pose_print.h"

#include <stdlib.h>

/* ---- what moves ---------------------------------------------------------------------------------- */

/* For each node of the model, whether the clip moves it or one above it; NULL without memory. */
static bool *list_moved(const api_pose_query *query) {
  const tw_model *model = query->model;
  bool *moved = tw_alloc_zero(model->node_count, sizeof *moved);
  for (uint32_t i = 0; moved && query->clip && i < model->node_count; i++) {
    uint32_t node = model->node_order[i], parent = model->nodes[node].parent;
    moved[node] = tw_clip_moves(query->clip->compiled, node) || (parent != TW_NO_INDEX && moved[parent]);
  }
  return moved;
}

/* Whether a part of the answer's node `index` is the same at all times. */
static bool is_still(const api_pose_query *query, const bool *moved, const api_pose_part *part,
                     uint32_t index) {
  if (!query->clip) return true;
  if (query->is_skinning) return false;
  uint32_t node = query->nodes[index];
  if (query->is_world) return !moved[node];
  if (query->as == API_AS_MATRIX) return !tw_clip_moves(query->clip->compiled, node);
  return !tw_clip_changes(query->clip->compiled, node, part->path);
}

/* Fewer still ones print sooner among the others than they keep these apart. */
enum { FEW = 4 };

/* ---- taking -------------------------------------------------------------------------------------- */

typedef struct frame_maker {
  const api_pose_query *query;
  const float *row;
  const bool *moved;
  api_pose_run *runs;
  uint32_t run_count;
  bool has_still;
  api_text text;
} frame_maker;

static uint32_t count_still(const frame_maker *maker, const api_pose_part *part, uint32_t i) {
  uint32_t first = i;
  while (i < maker->query->node_count && is_still(maker->query, maker->moved, part, i)) i++;
  return i - first;
}

/* One part of all nodes, in runs that move and runs that do not. */
static void take_part(frame_maker *maker, const api_pose_part *part) {
  uint32_t count = maker->query->node_count;
  size_t width = api_pose_width(maker->query->as);
  for (uint32_t i = 0, still; i < count; i += still) {
    uint32_t first = i;
    while ((still = count_still(maker, part, i)) < FEW && i < count) {
      maker->has_still |= still > 0;
      i += still + 1;
    }
    if (i > count) i = count;
    if (i > first) {
      api_text_element(&maker->text);
      maker->runs[maker->run_count++] =
          (api_pose_run){maker->text.size, first * width + part->offset, part->width, i - first};
      maker->text.last = ']'; /* of what will be there */
    }
    if (still > 0) {
      api_text_element(&maker->text);
      api_text_vectors(&maker->text, maker->row + i * width + part->offset, width, part->width, still);
    }
  }
}

static bool take_text(frame_maker *maker, tw_arena *arena, api_pose_frame *out) {
  api_text *text = &maker->text;
  for (const api_pose_part *part = api_pose_parts(maker->query->as); part->name; part++) {
    api_text_member(text, part->name);
    api_text_add(text, "[");
    take_part(maker, part);
    api_text_add(text, "]");
  }
  api_text_add(text, "}");
  const char *copy = text->failed ? NULL : tw_arena_text(arena, text->data, text->size);
  *out = (api_pose_frame){copy, text->size, maker->run_count, maker->runs, maker->has_still};
  api_text_deinit(text);
  return copy != NULL;
}

bool api_pose_frame_take(const api_pose_query *query, const float *row, tw_arena *arena,
                         api_pose_frame *out) {
  size_t parts = 0, runs_most = query->node_count / (FEW + 1) + 1;
  while (api_pose_parts(query->as)[parts].name) parts++;
  bool *moved = list_moved(query);
  frame_maker maker = {.query = query, .row = row, .moved = moved};
  maker.runs = tw_arena_alloc(arena, runs_most, parts * sizeof *maker.runs);
  bool is_taken = moved && maker.runs && take_text(&maker, arena, out);
  free(moved);
  return is_taken;
}

void api_pose_frame_print(const api_pose_query *query, const api_pose_frame *frame, const float *row,
                          api_text *text) {
  size_t stride = api_pose_width(query->as), printed = 0;
  for (uint32_t i = 0; i < frame->run_count; i++) {
    const api_pose_run *run = &frame->runs[i];
    api_text_bytes(text, frame->text + printed, run->place - printed);
    api_text_vectors(text, row + run->offset, stride, run->width, run->count);
    printed = run->place;
  }
  api_text_bytes(text, frame->text + printed, frame->size - printed);
}
