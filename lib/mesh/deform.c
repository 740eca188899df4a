/* Moves a control mesh: morph targets first, then joints, as glTF 2.0 orders them. */
#include <assert.h>
#include <math.h>

#include "tweend/mesh.h"

static void morph_point(const tw_mesh *mesh, const float *weights, uint32_t point, double out[3]) {
  for (size_t c = 0; c < 3; c++) {
    out[c] = (double)mesh->positions[3 * (size_t)point + c];
    for (uint32_t m = 0; weights && m < mesh->morph_count; m++)
      out[c] += (double)weights[m] * (double)mesh->morphs[m][3 * (size_t)point + c];
  }
}

/* Adds share times matrix times point. */
static void add_moved(const float matrix[16], const double point[3], double share, double out[3]) {
  for (int c = 0; c < 3; c++)
    out[c] += share * ((double)matrix[c] * point[0] + (double)matrix[4 + c] * point[1] +
                       (double)matrix[8 + c] * point[2] + (double)matrix[12 + c]);
}

static void skin_point(const tw_skin_weights *skin, uint32_t point, const float *matrices,
                       uint32_t joint_count, const double at[3], double out[3]) {
  const uint16_t *joints = skin->joints + 4 * (size_t)point;
  const float *weights = skin->weights + 4 * (size_t)point;
  double total = 0;
  for (int k = 0; k < 4; k++)
    if (weights[k] > 0) total += (double)weights[k];
  out[0] = out[1] = out[2] = 0;
  for (int k = 0; k < 4; k++) {
    assert(joints[k] < joint_count);
    if (weights[k] > 0) add_moved(matrices + 16 * (size_t)joints[k], at, (double)weights[k] / total, out);
  }
  if (!(total > 0) && joint_count > 0) add_moved(matrices, at, 1, out);
}

tw_status tw_mesh_deform(const tw_mesh *mesh, const float *morph_weights, const float *joint_matrices,
                         uint32_t joint_count, float *out, tw_error *error) {
  const float *morphs = morph_weights ? morph_weights : mesh->morph_weights;
  bool skinned = joint_matrices && mesh->skin.joints;
  for (uint32_t p = 0; p < mesh->point_count; p++) {
    double at[3], moved[3];
    morph_point(mesh, morphs, p, at);
    if (skinned) skin_point(&mesh->skin, p, joint_matrices, joint_count, at, moved);
    for (size_t c = 0; c < 3; c++) {
      float value = (float)(skinned ? moved[c] : at[c]);
      if (!(fabsf(value) <= TW_COORDINATE_MAX)) {
        tw_fail(error, TW_INVALID, "the pose moves a point beyond 1e18");
        return tw_error_at(error, "/positions/%u/%zu", p, c);
      }
      out[3 * (size_t)p + c] = value;
    }
  }
  return TW_OK;
}
