/* Matches the bones of two skeletons: by a map, by humanoid maps, by equal names, by usual names. Earlier
 * ways win, and no bone is matched twice. */
#include "retarget_match.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

const char *const tw_match_names[] = {"map", "humanoid", "name", "usual"};

typedef struct matching {
  const tw_retarget_job *job;
  tw_arena *arena;
  tw_bone_match *match;
  bool *is_moved;                  /* [nodes of the source] by a track of the clip, other than weights */
  bool *is_taken;                  /* [nodes of the source] matched, or left without a target by the map */
  uint32_t source_bones[TW_BONES]; /* by humanoid map, else by usual names */
  uint32_t target_bones[TW_BONES];
  uint8_t *source_role, *target_role; /* [nodes] */
  tw_spine source_spine, target_spine;
} matching;

static void join(matching *m, uint32_t source, uint32_t target, tw_match by) {
  m->is_taken[source] = true;
  m->match->source_of[target] = source;
  m->match->by[target] = (uint8_t)by;
}

static bool is_free(const matching *m, uint32_t source, uint32_t target) {
  return source != TW_NO_INDEX && target != TW_NO_INDEX && !m->is_taken[source] &&
         m->match->source_of[target] == TW_NO_INDEX;
}

static tw_status apply_map(matching *m, tw_error *error) {
  const tw_retarget_job *job = m->job;
  for (uint32_t i = 0; i < job->map_count; i++) {
    tw_bone_pair pair = job->map[i];
    bool has_target = pair.target != TW_NO_INDEX;
    const char *which = NULL, *name = NULL;
    if (pair.source >= job->source.node_count || (has_target && pair.target >= job->target.node_count))
      which = "that is not there";
    else if (m->is_taken[pair.source])
      which = "of the source that an earlier entry names", name = job->source.nodes[pair.source].name;
    else if (has_target && m->match->source_of[pair.target] != TW_NO_INDEX)
      which = "of the target that an earlier entry names", name = job->target.nodes[pair.target].name;
    if (which) {
      tw_fail(error, TW_INVALID, "entry %u of the map names a node %s%s%.60s", i, which, name ? ": " : "",
              name ? name : "");
      return tw_error_at(error, "/map/%u", i);
    }
    if (has_target)
      join(m, pair.source, pair.target, TW_MATCH_MAP);
    else
      m->is_taken[pair.source] = m->match->is_left[pair.source] = true;
  }
  return TW_OK;
}

static bool is_spine(uint8_t role) {
  return role >= TW_BONE_SPINE && role <= TW_BONE_UPPER_CHEST;
}

/* By usual names without spines, which match_spines has matched. */
static void match_roles(matching *m, tw_match by) {
  for (uint32_t i = 0; i < TW_BONES; i++)
    if (is_free(m, m->source_bones[i], m->target_bones[i]) && !(by == TW_MATCH_USUAL && is_spine((uint8_t)i)))
      join(m, m->source_bones[i], m->target_bones[i], by);
}

/* ---- equal names ----------------------------------------------------------------------------- */

typedef struct named {
  const char *name;
  uint32_t node;
} named;

static int compare_named(const void *a, const void *b) {
  const named *left = a, *right = b;
  int order = strcmp(left->name, right->name);
  return order ? order : left->node < right->node ? -1 : left->node > right->node;
}

/* The nodes of the source that have names, by name, then by index. */
static named *list_names(const matching *m, uint32_t *count) {
  const tw_skeleton *source = &m->job->source;
  named *list = tw_arena_alloc_raw(m->arena, source->node_count, sizeof *list);
  *count = 0;
  for (uint32_t i = 0; list && i < source->node_count; i++)
    if (source->nodes[i].name) list[(*count)++] = (named){source->nodes[i].name, i};
  return list && tw_sort(list, *count, sizeof *list, compare_named) == TW_OK ? list : NULL;
}

/* The place in the list of the first node of a name, or where it would be. */
static uint32_t find_name(const named *list, uint32_t count, const char *name) {
  uint32_t low = 0, high = count;
  while (low < high) {
    uint32_t middle = low + (high - low) / 2;
    if (strcmp(list[middle].name, name) < 0)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

/* Whether equal names make a pair: nodes that are no bones, as meshes, may have them too, and count only
 * where the clip moves them, after bones. */
static bool are_bones(const matching *m, uint32_t source, uint32_t target, bool may_be_others) {
  return (may_be_others && m->is_moved[source]) ||
         (m->match->is_source_bone[source] && m->match->is_target_bone[target]);
}

/* The index of a node in a spine; the spine's count where the spine does not have the node. */
static uint32_t rank_in(const tw_spine *spine, uint32_t node) {
  uint32_t i = 0;
  while (i < spine->count && spine->nodes[i] != node) i++;
  return i;
}

/* Whether another node than this one is the bone that its name says, or the spine is complete without it:
 * then the node is a control of the rig. */
static bool is_taken_over(const tw_skeleton *skeleton, const uint32_t bones[TW_BONES], const tw_spine *spine,
                          uint8_t role, uint32_t node) {
  if (!is_spine(role)) return bones[role] != TW_NO_INDEX;
  return !skeleton->humanoid && spine->count > 0 && rank_in(spine, node) == spine->count;
}

/* "LeftShoulder" is a collar bone in one family of rigs and an upper arm in another; "hips" and "chest"
 * steer bones of a file whose own are "DEF-spine" and the like. */
static bool contradict(const matching *m, uint32_t source, uint32_t target) {
  uint8_t a = m->source_role[source], b = m->target_role[target];
  if (a != TW_BONES && b != TW_BONES) return a != b;
  if (a != TW_BONES) return is_taken_over(&m->job->target, m->target_bones, &m->target_spine, a, target);
  return b != TW_BONES && is_taken_over(&m->job->source, m->source_bones, &m->source_spine, b, source);
}

/* The first node of the source with a target's name that makes a pair with it: of several bones of one name
 * the first ones match, then the second ones. matched: [count] how many of the name that begins there are
 * matched, at least. Looks at no more than some. */
static uint32_t find_namesake(const matching *m, const named *list, uint32_t count, uint32_t *matched,
                              uint32_t target, bool may_be_others) {
  enum { NAMESAKES_MOST = 64 };
  const char *name = m->job->target.nodes[target].name;
  uint32_t first = find_name(list, count, name), at = first < count ? first + matched[first] : count;
  for (int looks = 0; looks < NAMESAKES_MOST && at < count && strcmp(list[at].name, name) == 0;
       looks++, at++) {
    uint32_t source = list[at].node;
    if (at == first + matched[first] && m->is_taken[source]) matched[first]++;
    if (is_free(m, source, target) && are_bones(m, source, target, may_be_others) &&
        !contradict(m, source, target))
      return source;
  }
  return TW_NO_INDEX;
}

static bool match_names(matching *m) {
  const tw_skeleton *target = &m->job->target;
  uint32_t count;
  const named *list = list_names(m, &count);
  uint32_t *matched = list ? tw_arena_alloc(m->arena, count, sizeof *matched) : NULL;
  if (!matched) return false;
  for (int pass = 0; pass < 2; pass++)
    for (uint32_t i = 0; i < target->node_count; i++) {
      if (!target->nodes[i].name || m->match->source_of[i] != TW_NO_INDEX) continue;
      uint32_t source = find_namesake(m, list, count, matched, i, pass == 1);
      if (source != TW_NO_INDEX) join(m, source, i, TW_MATCH_NAME);
    }
  return true;
}

/* ---- roles ----------------------------------------------------------------------------------- */

/* Joints of skins and bones of the humanoid map; without these all nodes. */
static bool *find_bones(tw_arena *arena, const tw_skeleton *skeleton) {
  bool *is_bone = tw_arena_alloc(arena, skeleton->node_count, sizeof *is_bone);
  for (uint32_t i = 0; is_bone && i < skeleton->node_count; i++)
    is_bone[i] = !skeleton->is_bone || skeleton->is_bone[i];
  return is_bone;
}

static uint8_t *find_roles(tw_arena *arena, const tw_skeleton *skeleton, const bool *is_bone,
                           uint32_t bones[TW_BONES], tw_spine *spine) {
  if (skeleton->humanoid) {
    memcpy(bones, skeleton->humanoid, TW_BONES * sizeof *bones);
    for (int i = TW_BONE_SPINE; i <= TW_BONE_UPPER_CHEST; i++)
      if (bones[i] != TW_NO_INDEX) spine->nodes[spine->count++] = bones[i];
  } else if (!tw_bones_guess(skeleton, is_bone, arena, bones, spine)) {
    return NULL;
  }
  uint8_t *roles = tw_arena_alloc_raw(arena, skeleton->node_count, sizeof *roles);
  if (!roles) return NULL;
  memset(roles, TW_BONES, skeleton->node_count);
  for (uint32_t i = 0; i < TW_BONES; i++)
    if (bones[i] != TW_NO_INDEX) roles[bones[i]] = (uint8_t)i;
  return roles;
}

/* ---- spines ---------------------------------------------------------------------------------- */

/* Bones of a spine that are not matched yet, and how far each is from the hips along the skeleton. */
typedef struct spine_places {
  uint32_t count, nodes[TW_SPINE_MOST];
  double places[TW_SPINE_MOST];
} spine_places;

/* The length of the way to a node from the hips, or from the root where these are not above. */
static double way_to(const tw_skeleton *skeleton, uint32_t node, uint32_t hips) {
  double length = 0;
  for (; node != TW_NO_INDEX && node != hips; node = skeleton->nodes[node].parent) {
    const float *way = skeleton->nodes[node].rest.translation;
    length += sqrt((double)way[0] * (double)way[0] + (double)way[1] * (double)way[1] +
                   (double)way[2] * (double)way[2]);
  }
  return length;
}

/* top: the bone at which places are 1. */
static void place_spine(const tw_skeleton *skeleton, uint32_t hips, uint32_t top, spine_places *out) {
  double whole = top == TW_NO_INDEX ? 0 : way_to(skeleton, top, hips);
  for (uint32_t i = 0; i < out->count; i++)
    out->places[i] = whole > 0 ? way_to(skeleton, out->nodes[i], hips) / whole : (i + 1.0) / (out->count + 1);
}

/* Matches each bone of the shorter spine with one of the longer, in order, so that the sum of the differences
 * of their places is the least. pairs: [shorter->count] indices into the longer. */
static void pair_spines(const spine_places *shorter, const spine_places *longer, uint32_t first,
                        uint32_t *pairs) {
  double costs[TW_SPINE_MOST][TW_SPINE_MOST]; /* of the bones so far, the last of them with that one */
  uint32_t before[TW_SPINE_MOST][TW_SPINE_MOST];
  for (uint32_t i = 0; i < shorter->count; i++) {
    uint32_t best = TW_NO_INDEX; /* of the longer's bones below j */
    for (uint32_t j = 0; j < longer->count; j++) {
      bool is_open = i == 0 ? j <= first : best != TW_NO_INDEX;
      costs[i][j] = INFINITY;
      before[i][j] = best;
      if (is_open)
        costs[i][j] = fabs(shorter->places[i] - longer->places[j]) + (i > 0 ? costs[i - 1][best] : 0);
      if (i > 0 && costs[i - 1][j] < (best == TW_NO_INDEX ? (double)INFINITY : costs[i - 1][best])) best = j;
    }
  }
  uint32_t last = longer->count - 1;
  for (uint32_t j = last; j-- > 0;)
    if (costs[shorter->count - 1][j] <= costs[shorter->count - 1][last]) last = j;
  for (uint32_t i = shorter->count; i-- > 0; last = before[i][last]) pairs[i] = last;
}

/* Whether a pair of spine bones would cross a pair that is matched already, as by a map: below it in one
 * figure and above it in the other. */
static bool crosses(const matching *m, uint32_t source, uint32_t target) {
  uint32_t from = rank_in(&m->source_spine, source), to = rank_in(&m->target_spine, target);
  for (uint32_t i = 0; i < m->target_spine.count; i++) {
    uint32_t other = rank_in(&m->source_spine, m->match->source_of[m->target_spine.nodes[i]]);
    if (other < m->source_spine.count && (i < to) != (other < from)) return true;
  }
  return false;
}

/* Spines have any number of bones: those match that are at about the same height. Where the target has more,
 * the first one matches the first, as bones above it share its motion. */
static void match_spines(matching *m) {
  const tw_skeleton *source = &m->job->source, *target = &m->job->target;
  spine_places from = {0}, to = {0};
  uint32_t pairs[TW_SPINE_MOST], tops[2] = {TW_NO_INDEX, TW_NO_INDEX};
  for (uint32_t i = 0; i < m->source_spine.count; i++)
    if (!m->is_taken[m->source_spine.nodes[i]]) from.nodes[from.count++] = m->source_spine.nodes[i];
  for (uint32_t i = 0; i < m->target_spine.count; i++)
    if (m->match->source_of[m->target_spine.nodes[i]] == TW_NO_INDEX)
      to.nodes[to.count++] = m->target_spine.nodes[i];
  for (uint32_t bone = TW_BONE_HEAD; bone >= TW_BONE_NECK; bone--)
    if (m->source_bones[bone] != TW_NO_INDEX && m->target_bones[bone] != TW_NO_INDEX)
      tops[0] = m->source_bones[bone], tops[1] = m->target_bones[bone];
  if (from.count == 0 || to.count == 0) return;
  place_spine(source, m->source_bones[TW_BONE_HIPS], tops[0], &from);
  place_spine(target, m->target_bones[TW_BONE_HIPS], tops[1], &to);
  bool has_more = to.count > from.count, is_whole = to.count == m->target_spine.count;
  const spine_places *shorter = has_more ? &from : &to, *longer = has_more ? &to : &from;
  pair_spines(shorter, longer, has_more && is_whole ? 0 : TW_SPINE_MOST, pairs);
  for (uint32_t i = 0; i < shorter->count; i++) {
    uint32_t pair[2] = {shorter->nodes[i], longer->nodes[pairs[i]]};
    if (crosses(m, pair[!has_more], pair[has_more])) continue;
    join(m, pair[!has_more], pair[has_more], TW_MATCH_USUAL);
    if (m->target_role[pair[has_more]] == TW_BONES) m->target_role[pair[has_more]] = TW_BONE_CHEST;
  }
}

static void note_roles(const matching *m) {
  for (uint32_t i = 0; i < m->job->target.node_count; i++) {
    uint32_t source = m->match->source_of[i];
    m->match->role[i] = m->target_role[i];
    if (source != TW_NO_INDEX && m->match->role[i] == TW_BONES) m->match->role[i] = m->source_role[source];
  }
}

/* ---- enough bones ---------------------------------------------------------------------------- */

/* Adds names to a sentence as far as they fit. */
static void add_names(char *text, size_t size, const char *before, const tw_skeleton *skeleton,
                      const bool *wanted) {
  enum { NAMES = 6 };
  size_t used = strlen(text);
  uint32_t count = 0;
  for (uint32_t i = 0; i < skeleton->node_count; i++) {
    const char *name = skeleton->nodes[i].name;
    if (!wanted[i] || !name || strlen(name) > 40) continue;
    bool fits = used + strlen(before) + strlen(name) + 8 < size;
    if (count == NAMES || !fits) {
      strcat(text, ", …");
      return;
    }
    strcat(text, count == 0 ? before : ", ");
    strcat(text, name);
    used = strlen(text);
    count++;
  }
}

static tw_status refuse(const matching *m, uint32_t matched, uint32_t wanted, tw_error *error) {
  char text[260];
  bool *open_targets = tw_arena_alloc(m->arena, m->job->target.node_count, sizeof *open_targets);
  bool *open_sources = tw_arena_alloc(m->arena, m->job->source.node_count, sizeof *open_sources);
  if (!open_targets || !open_sources) return tw_fail(error, TW_NO_MEMORY, "no memory to match bones");
  for (uint32_t i = 0; i < m->job->target.node_count; i++)
    open_targets[i] = m->match->is_target_bone[i] && m->match->source_of[i] == TW_NO_INDEX;
  for (uint32_t i = 0; i < m->job->source.node_count; i++)
    open_sources[i] = m->is_moved[i] && !m->is_taken[i];
  snprintf(text, sizeof text, "%u of %u %s, fewer than half; a map names pairs", matched, wanted,
           tw_plural(wanted, "bone matches", "bones match"));
  add_names(text, 160, "; the clip moves ", &m->job->source, open_sources);
  add_names(text, sizeof text, "; the model has ", &m->job->target, open_targets);
  return tw_fail(error, TW_UNSUPPORTED, "%s", text);
}

/* Compares the matched bones with those that the clip moves and the map does not leave out, or with the
 * target's where these are fewer: a figure without fingers takes the clips of one that has some. A clip of
 * morph weights alone needs none. */
static tw_status check_enough(const matching *m, tw_error *error) {
  const tw_retarget_job *job = m->job;
  uint32_t moved = 0, matched = 0, targets = 0;
  for (uint32_t i = 0; i < job->source.node_count; i++) moved += m->is_moved[i] && !m->match->is_left[i];
  for (uint32_t i = 0; i < job->target.node_count; i++) {
    uint32_t source = m->match->source_of[i];
    targets += m->match->is_target_bone[i];
    matched += source != TW_NO_INDEX && m->is_moved[source];
  }
  uint32_t wanted = moved < targets ? moved : targets;
  bool is_enough = moved == 0 || (matched > 0 && 2 * (uint64_t)matched >= wanted);
  return is_enough ? TW_OK : refuse(m, matched, wanted, error);
}

static tw_status check_skeleton(const tw_skeleton *skeleton, const char *which, tw_error *error) {
  for (uint32_t i = 0; i < skeleton->node_count; i++)
    if (skeleton->nodes[i].parent != TW_NO_INDEX) return TW_OK;
  return tw_fail(error, TW_UNSUPPORTED, "%s has no skeleton: no node hangs on another", which);
}

tw_status tw_bones_match(const tw_retarget_job *job, tw_arena *arena, tw_bone_match *out, tw_error *error) {
  tw_status status = check_skeleton(&job->source, "the clip's model", error);
  if (status == TW_OK) status = check_skeleton(&job->target, "the model", error);
  if (status != TW_OK) return status;
  uint32_t targets = job->target.node_count;
  *out = (tw_bone_match){.source_of = tw_arena_alloc_raw(arena, targets, sizeof *out->source_of),
                         .by = tw_arena_alloc(arena, targets, sizeof *out->by),
                         .role = tw_arena_alloc(arena, targets, sizeof *out->role),
                         .is_source_bone = find_bones(arena, &job->source),
                         .is_target_bone = find_bones(arena, &job->target),
                         .is_left = tw_arena_alloc(arena, job->source.node_count, sizeof *out->is_left),
                         .has_map = job->source.humanoid && job->target.humanoid};
  matching m = {.job = job,
                .arena = arena,
                .match = out,
                .is_moved = tw_arena_alloc(arena, job->source.node_count, sizeof *m.is_moved),
                .is_taken = tw_arena_alloc(arena, job->source.node_count, sizeof *m.is_taken)};
  if (out->is_source_bone)
    m.source_role = find_roles(arena, &job->source, out->is_source_bone, m.source_bones, &m.source_spine);
  if (out->is_target_bone)
    m.target_role = find_roles(arena, &job->target, out->is_target_bone, m.target_bones, &m.target_spine);
  if (!out->source_of || !out->by || !out->role || !out->is_left || !m.is_moved || !m.is_taken ||
      !m.source_role || !m.target_role)
    return tw_fail(error, TW_NO_MEMORY, "no memory to match bones");
  for (uint32_t i = 0; i < targets; i++) out->source_of[i] = TW_NO_INDEX;
  for (uint32_t i = 0; i < job->keys->track_count; i++)
    if (job->keys->tracks[i].path != TW_WEIGHTS) m.is_moved[job->keys->tracks[i].node] = true;
  status = apply_map(&m, error);
  if (status != TW_OK) return status;
  if (out->has_map) match_roles(&m, TW_MATCH_HUMANOID);
  if (!match_names(&m)) return tw_fail(error, TW_NO_MEMORY, "no memory to match bones");
  if (!out->has_map) match_spines(&m);
  match_roles(&m, TW_MATCH_USUAL);
  note_roles(&m);
  return check_enough(&m, error);
}

void tw_bones_list(const tw_retarget_job *job, const tw_bone_match *match, uint32_t out[2][TW_BONES]) {
  for (uint32_t i = 0; i < TW_BONES; i++) out[0][i] = out[1][i] = TW_NO_INDEX;
  for (uint32_t node = 0; node < job->target.node_count; node++) {
    if (match->source_of[node] == TW_NO_INDEX || match->role[node] == TW_BONES) continue;
    out[0][match->role[node]] = match->source_of[node];
    out[1][match->role[node]] = node;
  }
}
