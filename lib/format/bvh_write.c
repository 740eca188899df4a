/* Writes BVH: the hierarchy, then a line of numbers a frame, computed as it is read.
 *
 * BVH has neither scale nor rotations at rest: a joint's OFFSET and channels are all there is. What scale and
 * shear of the ancestors do to a joint is kept as its `stretch`: its linear part is that of its rotation in
 * the file times the stretch. So joints stand where the model has them, whatever is above them. While all
 * stretches are uniform and still, which is usual, rotations are written as the clip has them and bones keep
 * their lengths. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "clip.h"
#include "tweend/format.h"
#include "tweend/json_print.h"

enum {
  NUMBER_SUFFIX = 11, /* most bytes of "_" and a node's index */
  TABS_MOST = 32,     /* of indentation: a chain of joints must not take the square of its length */
  PIECE = 32 * 1024,
  PIECE_TRANSFORMS = 1 << 16, /* about as many as a read computes */
  WARNINGS = 3
};

static const double PLACES = 1e5; /* angles are rounded to 1e-5 degrees, as exact as a clip has them */

typedef struct bvh_joint {
  uint32_t node;   /* TW_NO_INDEX for the root that joins several */
  uint32_t parent; /* joint, or TW_NO_INDEX */
  uint32_t end;    /* the child of a leaf that becomes its End Site, or TW_NO_INDEX */
  uint32_t depth;
  tw_euler_order order;
  bool has_positions; /* position channels; its OFFSET is then 0, which readers add or not */
  bool is_uneven;     /* its stretch is not uniform or not still */
  bool is_leaf;
  /* of the frame computed last */
  double rotation[4], translation[3], stretch[9]; /* stretch: by columns */
  double angles[3];
} bvh_joint;

struct tw_bvh_stream {
  tw_arena *arena;
  tw_bvh_options options;
  bvh_joint *joints; /* [joint_count], parents first, in the file's order */
  uint32_t joint_count, channel_count, warning_count;
  tw_trs *locals; /* [node_count] */
  const char *warnings[WARNINGS];
  uint64_t next; /* frame */
  bool has_head, has_angles;
  tw_text text;
  size_t read;
};

/* ---- which nodes are joints ------------------------------------------------------------------ */

/* Whether the node is an end site as reading BVH makes them: an only child, still and bare, named after its
 * parent. */
static bool is_end_site(const tw_bvh_options *o, uint32_t node, const uint32_t *children) {
  const tw_node *n = &o->model->nodes[node];
  const char *parent = n->parent == TW_NO_INDEX ? NULL : o->model->nodes[n->parent].name;
  size_t length = parent ? strlen(parent) : 0;
  bool is_named =
      parent && n->name && strncmp(n->name, parent, length) == 0 && !strcmp(n->name + length, "_end");
  return is_named && children[node] == 0 && children[n->parent] == 1 && n->mesh == TW_NO_INDEX &&
         !(o->clip && tw_clip_moves(o->clip, node));
}

/* Marks the nodes that become joints. Returns how many. */
static uint32_t mark_joints(const tw_bvh_options *o, const uint32_t *children, bool *is_joint) {
  const tw_model *model = o->model;
  uint32_t count = 0;
  for (uint32_t i = model->node_count; i-- > 0;) { /* children before their parents */
    uint32_t node = model->node_order[i];
    switch (o->choice) {
    case TW_BVH_MOVED: is_joint[node] |= o->clip && tw_clip_moves(o->clip, node); break;
    case TW_BVH_LISTED: is_joint[node] |= o->is_listed[node]; break;
    case TW_BVH_ALL: is_joint[node] |= !is_end_site(o, node, children); break;
    }
    uint32_t parent = model->nodes[node].parent;
    if (is_joint[node] && parent != TW_NO_INDEX) is_joint[parent] = true;
    count += is_joint[node];
  }
  return count;
}

/* Links from each node to its first child and its next sibling, in ascending order; the roots are children of
 * the node behind the last. */
typedef struct tree {
  uint32_t *first, *next, *children; /* [node_count + 1], [node_count], [node_count] */
} tree;

static bool link_nodes(const tw_model *model, tw_arena *arena, tree *out) {
  uint32_t count = model->node_count;
  out->first = tw_arena_alloc_raw(arena, (size_t)count + 1, sizeof(uint32_t));
  out->next = tw_arena_alloc_raw(arena, count, sizeof(uint32_t));
  out->children = tw_arena_alloc(arena, count, sizeof(uint32_t));
  if (!out->first || !out->next || !out->children) return false;
  memset(out->first, 0xFF, ((size_t)count + 1) * sizeof(uint32_t));
  for (uint32_t i = count; i-- > 0;) {
    uint32_t parent = model->nodes[i].parent;
    if (parent != TW_NO_INDEX) out->children[parent]++;
    uint32_t *first = &out->first[parent == TW_NO_INDEX ? count : parent];
    out->next[i] = *first;
    *first = i;
  }
  return true;
}

static uint32_t first_marked(uint32_t node, const tree *t, const bool *is_joint) {
  while (node != TW_NO_INDEX && !is_joint[node]) node = t->next[node];
  return node;
}

/* The child of a leaf that its End Site shows; TW_NO_INDEX without children. */
static uint32_t end_of(const tw_bvh_options *o, const tree *t, uint32_t node) {
  uint32_t found = t->first[node];
  for (uint32_t child = found; child != TW_NO_INDEX; child = t->next[child])
    if (is_end_site(o, child, t->children)) found = child;
  return found;
}

static bvh_joint *add_joint(tw_bvh_stream *s, uint32_t node, uint32_t parent) {
  bvh_joint *joint = &s->joints[s->joint_count++];
  *joint = (bvh_joint){.node = node,
                       .parent = parent,
                       .end = TW_NO_INDEX,
                       .rotation = {0, 0, 0, 1},
                       .stretch = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  joint->depth = parent == TW_NO_INDEX ? 0 : s->joints[parent].depth + 1;
  return joint;
}

/* Adds the marked nodes, each before its children. */
static void order_joints(tw_bvh_stream *s, const tree *t, const bool *is_joint) {
  uint32_t roots = s->options.model->node_count, at = first_marked(t->first[roots], t, is_joint);
  uint32_t top = TW_NO_INDEX, parent;
  if (at != TW_NO_INDEX && first_marked(t->next[at], t, is_joint) != TW_NO_INDEX) {
    top = s->joint_count; /* most readers take one root only */
    add_joint(s, TW_NO_INDEX, TW_NO_INDEX);
  }
  parent = top;
  while (at != TW_NO_INDEX) {
    bvh_joint *joint = add_joint(s, at, parent);
    uint32_t child = first_marked(t->first[at], t, is_joint);
    joint->is_leaf = child == TW_NO_INDEX;
    if (joint->is_leaf) joint->end = end_of(&s->options, t, at);
    if (!joint->is_leaf) parent = s->joint_count - 1;
    uint32_t next = joint->is_leaf ? first_marked(t->next[at], t, is_joint) : child;
    while (next == TW_NO_INDEX && parent != top) { /* up to the next sibling of an ancestor */
      next = first_marked(t->next[s->joints[parent].node], t, is_joint);
      parent = s->joints[parent].parent;
    }
    at = next;
  }
}

static tw_status find_joints(tw_bvh_stream *s, tw_arena *scratch, tw_error *error) {
  const tw_model *model = s->options.model;
  tree links;
  bool *is_joint = tw_arena_alloc(scratch, model->node_count, sizeof *is_joint);
  if (!is_joint || !link_nodes(model, scratch, &links)) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  uint32_t count = mark_joints(&s->options, links.children, is_joint);
  if (count == 0 && s->options.choice == TW_BVH_MOVED) {
    s->options.choice = TW_BVH_ALL;
    count = mark_joints(&s->options, links.children, is_joint);
  }
  if (count == 0) return tw_fail(error, TW_INVALID, "the model has no node to write as a joint");
  s->joints = tw_arena_alloc_raw(s->arena, (size_t)count + 1, sizeof *s->joints);
  s->locals = tw_arena_alloc_raw(s->arena, model->node_count, sizeof *s->locals);
  if (!s->joints || !s->locals) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  order_joints(s, &links, is_joint);
  return TW_OK;
}

/* ---- transforms ------------------------------------------------------------------------------ */

/* Whether the scale of a transform is one positive number, but for rounding. */
static bool is_uniform(const float scale[3]) {
  static const float ROOM = 1e-5f;
  float most = fmaxf(fmaxf(scale[0], scale[1]), scale[2]), least = fminf(fminf(scale[0], scale[1]), scale[2]);
  return least > 0 && most - least <= ROOM * most;
}

/* The local transform of a node as rotation, translation and scale; false where it shears. */
static bool take_local(const tw_bvh_stream *s, uint32_t node, tw_trs *out) {
  const tw_node *n = &s->options.model->nodes[node];
  bool has_matrix = n->has_matrix && !(s->options.clip && tw_clip_moves(s->options.clip, node));
  *out = s->locals[node];
  return !has_matrix || tw_trs_from_matrix(n->matrix, out);
}

static void multiply3(const double a[9], const double b[9], double out[9]) {
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) {
      double sum = 0;
      for (int k = 0; k < 3; k++) sum += a[3 * k + row] * b[3 * column + k];
      out[3 * column + row] = sum;
    }
}

/* The linear part of a node's local transform, by columns. */
static void linear_of(const tw_bvh_stream *s, uint32_t node, const tw_trs *local, bool is_whole,
                      double out[9]) {
  float matrix[16];
  if (is_whole)
    tw_trs_to_matrix(local, matrix);
  else
    memcpy(matrix, s->options.model->nodes[node].matrix, sizeof matrix);
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) out[3 * column + row] = (double)matrix[4 * column + row];
}

/* Splits a linear part into the nearest rotation and the stretch within it. */
static void split_linear(const double linear[9], double rotation[4], double stretch[9]) {
  float matrix[16] = {0}, turned[9];
  tw_trs nearest = TW_TRS_IDENTITY;
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) matrix[4 * column + row] = (float)linear[3 * column + row];
  matrix[15] = 1;
  tw_trs_from_matrix(matrix, &nearest);
  quat_widen(nearest.rotation, rotation);
  quat_matrix(nearest.rotation, turned);
  double inverse[9];
  for (int column = 0; column < 3; column++)
    for (int row = 0; row < 3; row++) inverse[3 * column + row] = (double)turned[3 * row + column];
  multiply3(inverse, linear, stretch);
}

/* Computes a joint from its local transform; its parent is computed. */
static void place_joint(const tw_bvh_stream *s, bvh_joint *joint) {
  static const double plain[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (joint->node == TW_NO_INDEX) return;
  const bvh_joint *parent = joint->parent == TW_NO_INDEX ? NULL : &s->joints[joint->parent];
  const double *above = parent ? parent->stretch : plain;
  tw_trs local;
  bool is_whole = take_local(s, joint->node, &local);
  for (int row = 0; row < 3; row++) {
    joint->translation[row] = 0;
    for (int k = 0; k < 3; k++) joint->translation[row] += above[3 * k + row] * (double)local.translation[k];
  }
  if (is_whole && is_uniform(local.scale) && !(parent && parent->is_uneven)) {
    quat_widen(local.rotation, joint->rotation);
    for (int i = 0; i < 9; i++) joint->stretch[i] = above[i] * (double)local.scale[0];
    return;
  }
  double linear[9], all[9];
  linear_of(s, joint->node, &local, is_whole, linear);
  multiply3(above, linear, all);
  split_linear(all, joint->rotation, joint->stretch);
}

static void place_joints(tw_bvh_stream *s) {
  for (uint32_t i = 0; i < s->joint_count; i++) place_joint(s, &s->joints[i]);
}

static void compute_frame(tw_bvh_stream *s, uint64_t frame) {
  const tw_bvh_options *o = &s->options;
  float time = tw_loop_time(o->from + (double)frame / o->fps, o->duration, o->loop);
  if (o->clip) tw_clip_pose(o->clip, o->model->nodes, o->model->node_count, time, s->locals);
  place_joints(s);
}

/* Transforms that a frame takes. */
static uint64_t transforms_of(const tw_bvh_stream *s) {
  const tw_bvh_options *o = &s->options;
  return o->model->node_count * (uint64_t)(o->clip ? tw_clip_cost(o->clip) : 1);
}

/* Puts the model at rest, and finds which joints need position channels: the root, those that a track moves,
 * and those below a stretch that would change the lengths of bones. */
static void choose_channels(tw_bvh_stream *s) {
  const tw_bvh_options *o = &s->options;
  for (uint32_t i = 0; i < o->model->node_count; i++) s->locals[i] = o->model->nodes[i].rest;
  for (uint32_t i = 0; i < s->joint_count; i++) {
    bvh_joint *joint = &s->joints[i];
    const bvh_joint *parent = joint->parent == TW_NO_INDEX ? NULL : &s->joints[joint->parent];
    bool is_node = joint->node != TW_NO_INDEX;
    unsigned paths = is_node && o->clip ? o->clip->moves[joint->node] : 0;
    bool moves = paths & 1u << TW_TRANSLATION, grows = paths & 1u << TW_SCALE;
    tw_trs local = TW_TRS_IDENTITY;
    bool is_even = !is_node || (take_local(s, joint->node, &local) && is_uniform(local.scale));
    joint->is_uneven = (parent && parent->is_uneven) || grows || !is_even;
    joint->has_positions = !parent || moves || parent->is_uneven;
    s->channel_count += joint->has_positions ? 6 : 3;
  }
  place_joints(s);
}

/* ---- orders ---------------------------------------------------------------------------------- */

/* Of each node the order of its track of Euler angles; XYZ where it has none. */
static void find_own_orders(const tw_clip *clip, uint32_t node_count, uint8_t *orders) {
  memset(orders, TW_XYZ, node_count);
  for (uint32_t i = 0; clip && i < clip->track_count; i++)
    if (clip->tracks[i].kind == TRACK_EULER) orders[clip->tracks[i].node] = (uint8_t)clip->tracks[i].order;
}

/* The order farthest from lock in its worst frame; of nearly equal ones the track's own, or XYZ, as
 * tw_track_inspect chooses. */
static tw_euler_order best_order(const double worst[TW_EULER_ORDERS], tw_euler_order own) {
  static const double ROOM = 1e-6;
  tw_euler_order best = own;
  for (int order = 0; order < TW_EULER_ORDERS; order++)
    if (worst[order] > worst[best] + ROOM) best = (tw_euler_order)order;
  return best;
}

static tw_status find_orders(tw_bvh_stream *s, tw_arena *scratch, tw_error *error) {
  enum { STEPS_A_TRANSFORM = 4 };
  double(*worst)[TW_EULER_ORDERS] = tw_arena_alloc_raw(scratch, s->joint_count, sizeof *worst);
  uint8_t *own = tw_arena_alloc_raw(scratch, s->options.model->node_count, sizeof *own);
  if (!worst || !own) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  find_own_orders(s->options.clip, s->options.model->node_count, own);
  for (uint32_t i = 0; i < s->joint_count; i++)
    for (int order = 0; order < TW_EULER_ORDERS; order++) worst[i][order] = 1;
  uint64_t steps = STEPS_A_TRANSFORM * transforms_of(s) + (uint64_t)s->joint_count * TW_EULER_ORDERS;
  for (uint64_t frame = 0; frame < s->options.frame_count; frame++) {
    if (!tw_work(steps)) return tw_work_status(error);
    compute_frame(s, frame);
    for (uint32_t i = 0; i < s->joint_count; i++)
      for (int order = 0; order < TW_EULER_ORDERS; order++)
        worst[i][order] =
            fmin(worst[i][order], tw_euler_cos_middle(s->joints[i].rotation, (tw_euler_order)order));
  }
  for (uint32_t i = 0; i < s->joint_count; i++) {
    uint32_t node = s->joints[i].node;
    s->joints[i].order = best_order(worst[i], node == TW_NO_INDEX ? TW_XYZ : (tw_euler_order)own[node]);
  }
  return TW_OK;
}

static tw_status choose_orders(tw_bvh_stream *s, tw_arena *scratch, tw_error *error) {
  if (s->options.order < 0) return find_orders(s, scratch, error);
  for (uint32_t i = 0; i < s->joint_count; i++) s->joints[i].order = (tw_euler_order)s->options.order;
  return TW_OK;
}

/* ---- losses ---------------------------------------------------------------------------------- */

static void warn(tw_bvh_stream *s, uint32_t count, const char *one, const char *many) {
  tw_error sentence;
  if (count == 0) return;
  tw_fail(&sentence, TW_OK, "%u %s", count, tw_plural(count, one, many));
  const char *kept = tw_arena_text(s->arena, sentence.detail, strlen(sentence.detail));
  if (kept) s->warnings[s->warning_count++] = kept;
}

/* Whether an earlier node has the node's name. */
static bool is_namesake(const tw_model *model, uint32_t node) {
  const uint32_t *all;
  return tw_model_namesakes(model, node, &all) > 1 && all[0] != node;
}

static void find_losses(tw_bvh_stream *s) {
  const tw_bvh_options *o = &s->options;
  uint32_t uneven = 0, weights = 0, names = 0;
  for (uint32_t i = 0; i < s->joint_count; i++) {
    uint32_t node = s->joints[i].node;
    if (node == TW_NO_INDEX) continue;
    const char *name = o->model->nodes[node].name;
    uneven += s->joints[i].is_uneven;
    names += name && (name[strcspn(name, " {}")] || is_namesake(o->model, node));
  }
  for (uint32_t i = 0; o->clip && i < tw_clip_track_count(o->clip); i++) {
    tw_path path;
    uint32_t node = tw_clip_target(o->clip, i, &path);
    weights += path == TW_WEIGHTS && (o->choice != TW_BVH_LISTED || o->is_listed[node]);
  }
  warn(s, weights, "track of morph weights is left out: BVH has none",
       "tracks of morph weights are left out: BVH has none");
  warn(s, uneven, "joint is scaled unevenly or by the clip: BVH has its place alone",
       "joints are scaled unevenly or by the clip: BVH has their places alone");
  warn(s, names, "name is changed: BVH has no blanks and braces in names, and readers want each once",
       "names are changed: BVH has no blanks and braces in names, and readers want each once");
}

/* ---- printing -------------------------------------------------------------------------------- */

static void print_indent(tw_text *text, uint32_t depth) {
  static const char tabs[TABS_MOST + 1] = "\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t\t";
  tw_text_bytes(text, tabs, depth < TABS_MOST ? depth : TABS_MOST);
}

static void print_name(const tw_bvh_stream *s, uint32_t node, tw_text *text) {
  char buffer[24];
  if (node == TW_NO_INDEX) {
    tw_text_add(text, "root");
    return;
  }
  const char *name = tw_model_node_name(s->options.model, node, buffer);
  bool is_told_apart = is_namesake(s->options.model, node);
  size_t length = strlen(name);
  if (is_told_apart && length > TW_NAME_MAX - NUMBER_SUFFIX) {
    length = TW_NAME_MAX - NUMBER_SUFFIX;
    while (((unsigned char)name[length] & 0xC0) == 0x80) length--; /* within a character of UTF-8 */
  }
  for (const char *c = name; c < name + length; c++)
    tw_text_bytes(text, *c == ' ' || *c == '{' || *c == '}' ? "_" : c, 1);
  if (!is_told_apart) return;
  tw_text_add(text, "_");
  tw_text_count(text, node);
}

/* Lengths beyond single precision, which only absurd scales make, are cut. */
static void print_length(tw_text *text, double length) {
  tw_text_float(text, (float)fmax(-(double)FLT_MAX, fmin((double)FLT_MAX, length)));
}

static void print_offset(tw_text *text, uint32_t depth, const double offset[3]) {
  print_indent(text, depth);
  tw_text_add(text, "OFFSET");
  for (int i = 0; i < 3; i++) {
    tw_text_add(text, " ");
    print_length(text, offset[i]);
  }
  tw_text_add(text, "\n");
}

static void open_block(tw_text *text, uint32_t depth) {
  tw_text_add(text, "\n");
  print_indent(text, depth);
  tw_text_add(text, "{\n");
}

static void close_block(tw_text *text, uint32_t depth) {
  print_indent(text, depth);
  tw_text_add(text, "}\n");
}

/* The End Site of a leaf: its child at rest, or the joint itself. */
static void print_end(const tw_bvh_stream *s, const bvh_joint *joint, tw_text *text) {
  double offset[3] = {0, 0, 0};
  tw_trs local = TW_TRS_IDENTITY;
  if (joint->end != TW_NO_INDEX) take_local(s, joint->end, &local);
  for (int row = 0; row < 3; row++)
    for (int k = 0; k < 3; k++) offset[row] += joint->stretch[3 * k + row] * (double)local.translation[k];
  print_indent(text, joint->depth + 1);
  tw_text_add(text, "End Site");
  open_block(text, joint->depth + 1);
  print_offset(text, joint->depth + 2, offset);
  close_block(text, joint->depth + 1);
}

static void print_joint(const tw_bvh_stream *s, const bvh_joint *joint, tw_text *text) {
  static const double none[3] = {0, 0, 0};
  static const char *const turns[] = {" Xrotation", " Yrotation", " Zrotation"};
  print_indent(text, joint->depth);
  tw_text_add(text, joint->depth == 0 ? "ROOT " : "JOINT ");
  print_name(s, joint->node, text);
  open_block(text, joint->depth);
  print_offset(text, joint->depth + 1, joint->has_positions ? none : joint->translation);
  print_indent(text, joint->depth + 1);
  tw_text_add(text, joint->has_positions ? "CHANNELS 6 Xposition Yposition Zposition" : "CHANNELS 3");
  for (int i = 0; i < 3; i++) tw_text_add(text, turns[tw_euler_axes[joint->order][i]]);
  tw_text_add(text, "\n");
  if (joint->is_leaf) print_end(s, joint, text);
}

/* Prints the hierarchy with the joints at rest. */
static void print_head(tw_bvh_stream *s, tw_text *text) {
  const tw_bvh_options *o = &s->options;
  for (uint32_t i = 0; i < o->model->node_count; i++) s->locals[i] = o->model->nodes[i].rest;
  place_joints(s);
  tw_text_add(text, "HIERARCHY\n");
  for (uint32_t i = 0; i < s->joint_count && !text->failed; i++) {
    print_joint(s, &s->joints[i], text);
    uint32_t next = i + 1 < s->joint_count ? s->joints[i + 1].depth : 0;
    for (uint32_t depth = s->joints[i].depth + 1; depth > next; depth--) close_block(text, depth - 1);
  }
  tw_text_add(text, "MOTION\nFrames: ");
  tw_text_count(text, o->frame_count);
  tw_text_add(text, "\nFrame Time: ");
  tw_text_double(text, 1 / o->fps);
  tw_text_add(text, "\n");
  s->has_head = true;
}

/* The triple nearest to that of the frame before, so that readers may interpolate angles. */
static void find_angles(const tw_bvh_stream *s, bvh_joint *joint) {
  double before[3];
  memcpy(before, joint->angles, sizeof before);
  if (s->has_angles)
    tw_euler_near(joint->rotation, joint->order, before, joint->angles);
  else
    tw_euler_of(joint->rotation, joint->order, joint->angles);
}

static void print_numbers(const bvh_joint *joint, tw_text *text) {
  for (int i = 0; joint->has_positions && i < 3; i++) {
    print_length(text, joint->translation[i]);
    tw_text_add(text, " ");
  }
  for (int i = 0; i < 3; i++) {
    double degrees = joint->angles[tw_euler_axes[joint->order][i]] * TW_DEGREES;
    tw_text_double(text, nearbyint(degrees * PLACES) / PLACES);
    tw_text_add(text, " ");
  }
}

static void print_frame(tw_bvh_stream *s, tw_text *text) {
  compute_frame(s, s->next++);
  for (uint32_t i = 0; i < s->joint_count && !text->failed; i++) {
    find_angles(s, &s->joints[i]);
    print_numbers(&s->joints[i], text);
  }
  s->has_angles = true;
  if (!text->failed) text->data[text->size - 1] = '\n'; /* in place of the last blank */
}

/* ---- the stream ------------------------------------------------------------------------------ */

static tw_status prepare(tw_bvh_stream *s, tw_error *error) {
  tw_arena *scratch = tw_arena_create();
  tw_status status = scratch ? find_joints(s, scratch, error) : tw_fail(error, TW_NO_MEMORY, "out of memory");
  if (status == TW_OK) {
    choose_channels(s);
    find_losses(s);
    status = choose_orders(s, scratch, error);
  }
  tw_arena_destroy(scratch);
  return status;
}

tw_status tw_bvh_stream_create(const tw_bvh_options *options, tw_bvh_stream **out, tw_error *error) {
  tw_arena *arena = tw_arena_create();
  tw_bvh_stream *s = arena ? tw_arena_alloc(arena, 1, sizeof *s) : NULL;
  if (!s) {
    tw_arena_destroy(arena);
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  }
  s->arena = arena;
  s->options = *options;
  tw_status status = prepare(s, error);
  if (status == TW_OK)
    *out = s;
  else
    tw_bvh_stream_destroy(s);
  return status;
}

void tw_bvh_stream_destroy(tw_bvh_stream *s) {
  if (!s) return;
  tw_text_deinit(&s->text);
  tw_arena_destroy(s->arena); /* holds the stream itself */
}

uint64_t tw_bvh_stream_numbers(const tw_bvh_stream *s) {
  return s->options.frame_count * s->channel_count;
}

uint32_t tw_bvh_stream_warnings(const tw_bvh_stream *s, const char *const **out) {
  *out = s->warnings;
  return s->warning_count;
}

int64_t tw_bvh_stream_read(tw_bvh_stream *s, uint8_t *out, size_t capacity) {
  if (s->read == s->text.size) {
    tw_text_clear(&s->text);
    s->read = 0;
    if (!s->has_head) print_head(s, &s->text);
    uint64_t each = transforms_of(s), work = 0;
    for (; s->next < s->options.frame_count && s->text.size < PIECE && work < PIECE_TRANSFORMS &&
           !s->text.failed;
         work += each)
      print_frame(s, &s->text);
    if (s->text.failed) return -1;
  }
  size_t left = s->text.size - s->read, count = left < capacity ? left : capacity;
  if (count) memcpy(out, s->text.data + s->read, count);
  s->read += count;
  return (int64_t)count;
}
