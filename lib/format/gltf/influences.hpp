// The joints that move a vertex: sets of four, JOINTS_n and WEIGHTS_n (glTF 2.0, section 3.7.3.1).
#ifndef TWEEND_GLTF_INFLUENCES_HPP
#define TWEEND_GLTF_INFLUENCES_HPP

#include <algorithm>
#include <array>

#include "gltf/vertex_sources.hpp"

namespace gltf {

struct Influence {
  uint16_t joint;
  float weight;
};

using Influences = std::array<Influence, 4 * joint_sets>;

// Reads all joints of an element, heaviest first, with the weights as the file has them; joint 0 with weight
// 0 where the primitive has fewer sets. mesh: its index, for the refusal of negative weights.
inline Influences read_influences(const VertexSource &source, uint32_t element, size_t mesh) {
  Influences all = {};
  for (size_t set = 0; set < joint_sets && source.joints[set]; set++) {
    float joint[4], weight[4];
    source.joints[set]->read(element, joint);
    source.weights[set]->read(element, weight);
    for (size_t k = 0; k < 4; k++) {
      if (weight[k] < 0) refuse(TW_INVALID, text("/meshes/", mesh), "a joint weight is negative");
      all[4 * set + k] = {static_cast<uint16_t>(joint[k]), weight[k]};
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Influence &a, const Influence &b) { return a.weight > b.weight; });
  return all;
}

// Writes the joints of a point, heaviest first, with weights scaled to a sum of 1. A point without weights
// gets joint 0 with weight 1. Returns the sum that they had. joints, weights: [width]
inline double write_influences(const Influences &all, size_t width, uint16_t *joints, float *weights) {
  double sum = 0;
  for (size_t k = 0; k < width; k++) sum += all[k].weight;
  for (size_t k = 0; k < width; k++) {
    joints[k] = all[k].weight > 0 ? all[k].joint : 0;
    weights[k] = sum > 0 ? static_cast<float>(all[k].weight / sum) : static_cast<float>(k == 0);
  }
  return sum;
}

// Pairs of a joint and its share, by joint, then 0: equal for all ways to write the same.
using Pulls = std::array<float, 8 * joint_sets>;

// What read_influences refuses counts as 0.
inline Pulls read_pulls(const VertexSource &source, uint32_t element) {
  std::array<std::pair<float, float>, 4 *joint_sets> pulls = {};
  size_t count = 0;
  double sum = 0;
  for (size_t set = 0; set < joint_sets && source.joints[set]; set++) {
    float joints[4] = {}, weights[4] = {};
    source.joints[set]->read_finite(element, joints);
    source.weights[set]->read_finite(element, weights);
    for (size_t k = 0; k < 4; k++) {
      if (!(weights[k] > 0)) continue;
      pulls[count++] = {joints[k], weights[k]};
      sum += static_cast<double>(weights[k]);
    }
  }
  std::sort(pulls.begin(), pulls.begin() + static_cast<std::ptrdiff_t>(count));
  Pulls out = {};
  size_t written = 0;
  for (size_t i = 0; i < count; i++) {
    bool again = written > 0 && out[2 * written - 2] == pulls[i].first;
    float share = static_cast<float>(static_cast<double>(pulls[i].second) / sum);
    if (again)
      out[2 * written - 1] += share;
    else
      out[2 * written] = pulls[i].first, out[2 * written + 1] = share, written++;
  }
  return out;
}

} // namespace gltf

#endif
