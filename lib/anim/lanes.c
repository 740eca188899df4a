/* Sixteen poses at once. Inner loops run over the lanes and nothing else, so that they become a few vector
 * instructions; the formulas and their order are those of one pose. */
#include "clip.h"
#include "processor.h"

/* One number of sixteen poses. */
typedef struct lane_row {
  float at[TW_LANES];
} lane_row;

/* ---- local transforms ------------------------------------------------------------------------------- */

static void put_at_rest(const tw_trs *rest, lane_row *rows) {
  for (int lane = 0; lane < TW_LANES; lane++) {
    for (int i = 0; i < 3; i++) rows[i].at[lane] = rest->translation[i];
    for (int i = 0; i < 4; i++) rows[3 + i].at[lane] = rest->rotation[i];
    for (int i = 0; i < 3; i++) rows[7 + i].at[lane] = rest->scale[i];
  }
}

static inline __attribute__((always_inline)) void transpose(const float *restrict samples, uint32_t width,
                                                            lane_row *restrict rows) {
  for (uint32_t i = 0; i < width; i++)
    for (uint32_t lane = 0; lane < TW_LANES; lane++) rows[i].at[lane] = samples[lane * width + i];
}

/* The widths are constants, so that the loops become shuffles. */
static void put_samples(const float *samples, uint32_t width, lane_row *rows) {
  if (width == 4)
    transpose(samples, 4, rows);
  else
    transpose(samples, 3, rows);
}

void tw_clip_lanes(const tw_clip *clip, const tw_node *nodes, uint32_t node_count,
                   const float times[TW_LANES], float *locals) {
  static const uint32_t first_rows[] = {[TW_TRANSLATION] = 0, [TW_ROTATION] = 3, [TW_SCALE] = 7};
  lane_row *rows = (lane_row *)locals;
  float clamped[TW_LANES], samples[4 * TW_LANES];
  uint32_t keys[TW_LANES];
  const tw_timeline *timeline = NULL;
  for (uint32_t i = 0; i < node_count; i++) put_at_rest(&nodes[i].rest, rows + (size_t)i * TW_LANE_TRS);
  for (uint32_t i = 0; i < clip->posed_count; i++) {
    const tw_track *track = &clip->tracks[clip->posed[i]];
    if (track->timeline != timeline) tw_timeline_find(track->timeline, times, TW_LANES, clamped, keys);
    timeline = track->timeline;
    tw_track_sample(track, clamped, keys, TW_LANES, samples, track->width * sizeof *samples);
    put_samples(samples, track->width, rows + (size_t)track->node * TW_LANE_TRS + first_rows[track->path]);
  }
}

/* ---- world matrices --------------------------------------------------------------------------------- */

/* out = parent x local, of a transform: quat.h's matrix of the rotation, its columns scaled. Products are
 * what this costs: a scale that is known to be 1 saves a seventh of them. */
static inline __attribute__((always_inline)) void multiply_trs(const lane_row *restrict parent,
                                                               const lane_row *restrict trs, bool is_scaled,
                                                               lane_row *restrict out) {
  for (int lane = 0; lane < TW_LANES; lane++) {
    const float q[4] = {trs[3].at[lane], trs[4].at[lane], trs[5].at[lane], trs[6].at[lane]};
    float m[9];
    quat_matrix(q, m);
    for (size_t column = 0; column < 3; column++) {
      float scale = is_scaled ? trs[7 + column].at[lane] : 1;
      float x = m[3 * column] * scale, y = m[3 * column + 1] * scale, z = m[3 * column + 2] * scale;
      for (size_t row = 0; row < 3; row++)
        out[3 * column + row].at[lane] =
            parent[row].at[lane] * x + parent[3 + row].at[lane] * y + parent[6 + row].at[lane] * z;
    }
    for (size_t row = 0; row < 3; row++)
      out[9 + row].at[lane] = parent[row].at[lane] * trs[0].at[lane] +
                              parent[3 + row].at[lane] * trs[1].at[lane] +
                              parent[6 + row].at[lane] * trs[2].at[lane] + parent[9 + row].at[lane];
  }
}

/* out = parent x matrix, the same in every lane. */
static void multiply_matrix(const lane_row *restrict parent, const float matrix[16], lane_row *restrict out) {
  for (size_t column = 0; column < 4; column++)
    for (size_t row = 0; row < 3; row++)
      for (int lane = 0; lane < TW_LANES; lane++) {
        const float *factors = matrix + 4 * column;
        float sum = parent[row].at[lane] * factors[0] + parent[3 + row].at[lane] * factors[1] +
                    parent[6 + row].at[lane] * factors[2];
        out[3 * column + row].at[lane] = column < 3 ? sum : sum + parent[9 + row].at[lane];
      }
}

/* Whether transforms that the clip made may have a scale other than 1. */
static bool may_scale(const tw_clip *clip, const tw_node *node, uint32_t index) {
  const float *rest = node->rest.scale;
  return !clip || clip->moves[index] & 1u << TW_SCALE || rest[0] != 1 || rest[1] != 1 || rest[2] != 1;
}

static inline __attribute__((always_inline)) void world_matrices(const tw_clip *clip, const tw_node *nodes,
                                                                 const uint32_t *order, uint32_t node_count,
                                                                 const lane_row *locals, lane_row *world) {
  lane_row identity[TW_LANE_MATRIX] = {{{0}}};
  for (size_t i = 0; i < 3; i++)
    for (int lane = 0; lane < TW_LANES; lane++) identity[4 * i].at[lane] = 1;
  for (uint32_t i = 0; i < node_count; i++) {
    const tw_node *node = &nodes[order[i]];
    const lane_row *parent =
        node->parent == TW_NO_INDEX ? identity : world + (size_t)node->parent * TW_LANE_MATRIX;
    const lane_row *trs = locals + (size_t)order[i] * TW_LANE_TRS;
    lane_row *out = world + (size_t)order[i] * TW_LANE_MATRIX;
    if (node->has_matrix && !(clip && tw_clip_moves(clip, order[i])))
      multiply_matrix(parent, node->matrix, out);
    else if (may_scale(clip, node, order[i]))
      multiply_trs(parent, trs, true, out);
    else
      multiply_trs(parent, trs, false, out);
  }
}

typedef void world_kernel(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                          uint32_t node_count, const lane_row *locals, lane_row *world);

static void world_matrices_anywhere(const tw_clip *clip, const tw_node *nodes, const uint32_t *order,
                                    uint32_t node_count, const lane_row *locals, lane_row *world) {
  world_matrices(clip, nodes, order, node_count, locals, world);
}

#ifdef __x86_64__
static __attribute__((target("avx2"))) void world_matrices_avx2(const tw_clip *clip, const tw_node *nodes,
                                                                const uint32_t *order, uint32_t node_count,
                                                                const lane_row *locals, lane_row *world) {
  world_matrices(clip, nodes, order, node_count, locals, world);
}

static __attribute__((target("avx512f,avx512vl,avx512dq"))) void
world_matrices_avx512(const tw_clip *clip, const tw_node *nodes, const uint32_t *order, uint32_t node_count,
                      const lane_row *locals, lane_row *world) {
  world_matrices(clip, nodes, order, node_count, locals, world);
}
#endif

static world_kernel *const kernels[TW_SETS] = {world_matrices_anywhere,
#ifdef __x86_64__
                                               world_matrices_avx2, world_matrices_avx512
#endif
};

void tw_lanes_world(const tw_clip *clip, const tw_node *nodes, const uint32_t *order, uint32_t node_count,
                    const float *locals, float *world) {
  kernels[tw_processor_best()](clip, nodes, order, node_count, (const lane_row *)locals, (lane_row *)world);
}

void tw_lanes_matrix(const float *world, uint32_t node, uint32_t lane, float out[16]) {
  const lane_row *rows = (const lane_row *)world + (size_t)node * TW_LANE_MATRIX;
  for (int column = 0; column < 4; column++) {
    for (int row = 0; row < 3; row++) out[4 * column + row] = rows[3 * column + row].at[lane];
    out[4 * column + 3] = column < 3 ? 0 : 1;
  }
}
