/* A clip evaluated at times, printed piece by piece: memory does not grow with the number of times. */
#ifndef API_POSE_BODY_H
#define API_POSE_BODY_H

#include "clips.h"
#include "times.h"

typedef enum api_pose_as { API_AS_TRS, API_AS_MATRIX, API_AS_EULER, API_AS_AXIS_ANGLE } api_pose_as;

/* In the order of the route's offers. */
typedef enum api_pose_form { API_POSE_JSON, API_POSE_NDJSON, API_POSE_BIN, API_POSE_CSV } api_pose_form;

/* What is asked. Owns nothing: all of it outlives the body. */
typedef struct api_pose_query {
  const tw_model *model;
  const api_clip *clip; /* NULL: the rest pose */
  api_times times;
  api_pose_form form;
  api_pose_as as;
  bool is_world;
  tw_euler_order order;
  bool in_degrees;
  tw_loop loop;
  bool is_skinning; /* joint matrices of all skins, skin by skin, in place of nodes */
  uint32_t node_count;
  const uint32_t *nodes; /* [node_count], what the answer tells of; ascending unless is_skinning */
} api_pose_query;

/* Whether the answer tells of all nodes, each once. */
static inline bool api_pose_has_all_nodes(const api_pose_query *query) {
  return query->node_count == query->model->node_count && !query->is_skinning;
}

typedef struct api_pose_body api_pose_body;

/* Numbers of one part of some nodes, one node after the other, that time changes. */
typedef struct api_pose_run {
  size_t place;          /* in the frame's text */
  size_t offset;         /* in a row, of the first node's */
  uint32_t width, count; /* numbers of a node; nodes */
} api_pose_run;

/* A pose as JSON after its time, without the runs that belong into it. */
typedef struct api_pose_frame {
  const char *text;
  size_t size;
  uint32_t run_count;
  const api_pose_run *runs; /* [run_count], in the order of the text */
  bool has_still;           /* the runs hold some numbers that time does not change, too */
} api_pose_frame;

/* What answers to one query have in common whatever their times, ready printed. */
typedef struct api_pose_template {
  const char *opening; /* up to the times */
  size_t opening_size;
  api_pose_frame frame; /* of JSON */
  size_t size;          /* of most answers at most */
} api_pose_template;

/* The template of a body that is printed to its end, in `size` bytes; of one time, since a binary opening
 * tells their number. False without memory. It lives as long as the arena. */
bool api_pose_template_take(const api_pose_body *body, size_t size, tw_arena *arena, api_pose_template *out);

/* NULL without memory. template: of the same query at another time, or NULL. arena: scratch in proportion to
 * the model's nodes. room: what is printed is put there as far as it fits. */
api_pose_body *api_pose_body_create(const api_pose_query *query, const api_pose_template *template,
                                    tw_arena *arena, api_room room);
void api_pose_body_deinit(api_pose_body *body);

/* Bytes of the whole answer where the form tells (bin), else API_SIZE_UNKNOWN. */
uint64_t api_pose_body_size(const api_pose_body *body);

/* Prints the whole answer, in place of reading it. */
void api_pose_body_print_whole(api_pose_body *body, api_text *text);

/* As in api_body. */
int64_t api_pose_body_read(void *context, uint8_t *out, size_t capacity);

/* Prints the pose at one time on the clip in the query's form; its own times do not matter. Angles go on from
 * the pose printed before. False without memory. */
bool api_pose_body_print(api_pose_body *body, float time, api_text *text);

#endif
