// Meshes: one tw_mesh for each, all its triangle primitives together, welded into a surface.
#include "gltf/assets.hpp"
#include "gltf/normal_map.hpp"
#include "gltf/primitive.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "weld.h"

namespace gltf {

namespace {

// Faces over vertices, before they are welded.
struct Faces {
  std::vector<uint32_t> offsets = {0}, corners;
  std::vector<int32_t> materials;

  size_t count() const { return materials.size(); }
  void end_face(int32_t material) {
    offsets.push_back(static_cast<uint32_t>(corners.size()));
    materials.push_back(material);
  }
};

void check_status(tw_status status) {
  if (status != TW_OK) throw std::bad_alloc(); // all that the C side can run out of here
}

template <typename Element>
const Element *copy(const Document &document, const std::vector<Element> &values) {
  Element *out = allocate<Element>(document, values.size());
  std::copy(values.begin(), values.end(), out);
  return out;
}

// Tells whether a face repeats a vertex.
class Repeats {
public:
  explicit Repeats(size_t count) : seen_(count) {}
  bool in(const uint32_t *corners, size_t count) {
    mark_++;
    for (size_t i = 0; i < count; i++) {
      if (seen_[corners[i]] == mark_) return true;
      seen_[corners[i]] = mark_;
    }
    return false;
  }

private:
  std::vector<uint32_t> seen_;
  uint32_t mark_ = 0;
};

class MeshReader {
public:
  MeshReader(Document &document, Accessors &accessors, size_t index, std::vector<uint32_t> &scratch)
      : document_(document), source_(document.source.meshes[index]), index_(index),
        mesh_(document.model->meshes[index]), parts_(read_primitives(document, accessors, index, scratch)) {}

  void read() {
    tw_mesh_init(&mesh_);
    mesh_.name = copy_name(document_, source_.name);
    if (!parts_.vertices.empty()) {
      build_faces();
      weld();
      drop_pinched_faces();
      write_points();
      write_uvs();
      write_morph_weights();
    }
    write_faces();
    document_.skipped_primitives += parts_.skipped;
    document_.degenerate_faces += parts_.degenerate;
    // A file that says what its polygons are says so of its triangles too.
    bool told = std::any_of(parts_.lists.begin(), parts_.lists.end(),
                            [](const TriangleList &list) { return list.polygons; });
    if (document_.quads == TW_QUADS_AUTO && !told)
      check_status(tw_pair_triangles(&mesh_, document_.model->arena, nullptr));
    if (mesh_.has_tangents) choose_tangent_uvs();
  }

private:
  Document &document_;
  const tinygltf::Mesh &source_;
  size_t index_;
  tw_mesh &mesh_;
  Primitives parts_;
  Faces faces_;
  std::vector<float> positions_;       // of the vertices
  std::vector<uint32_t> point_;        // of each vertex
  std::vector<uint32_t> first_vertex_; // of each point

  // ---- faces -----------------------------------------------------------------------------------

  // FB_ngon_encoding: a polygon is a fan, and the next one starts from another vertex.
  static size_t fan_end(const std::vector<uint32_t> &corners, size_t start) {
    size_t end = start + 3;
    while (end < corners.size() && corners[end] == corners[start] && corners[end + 1] == corners[end - 1])
      end += 3;
    return end;
  }

  void build_polygons(const TriangleList &list, Repeats &repeats) {
    std::vector<uint32_t> polygon;
    for (size_t start = 0, end; start < list.corners.size(); start = end) {
      end = fan_end(list.corners, start);
      polygon.assign(list.corners.begin() + static_cast<std::ptrdiff_t>(start),
                     list.corners.begin() + static_cast<std::ptrdiff_t>(start) + 3);
      for (size_t k = start + 3; k < end; k += 3) polygon.push_back(list.corners[k + 2]);
      if (repeats.in(polygon.data(), polygon.size())) {
        add_triangles(list, start, end);
        continue;
      }
      faces_.corners.insert(faces_.corners.end(), polygon.begin(), polygon.end());
      faces_.end_face(list.material);
    }
  }

  void add_triangles(const TriangleList &list, size_t start, size_t end) {
    auto corners = list.corners.begin();
    faces_.corners.insert(faces_.corners.end(), corners + static_cast<std::ptrdiff_t>(start),
                          corners + static_cast<std::ptrdiff_t>(end));
    size_t count = (end - start) / 3;
    for (size_t k = 0; k < count; k++) faces_.offsets.push_back(faces_.offsets.back() + 3);
    faces_.materials.insert(faces_.materials.end(), count, list.material);
  }

  void build_faces() {
    size_t corners = 0;
    for (const TriangleList &list : parts_.lists) corners += list.corners.size();
    faces_.corners.reserve(corners);
    faces_.offsets.reserve(corners / 3 + 1);
    faces_.materials.reserve(corners / 3);
    Repeats repeats(parts_.vertices.size());
    for (TriangleList &list : parts_.lists) {
      if (list.polygons)
        build_polygons(list, repeats);
      else
        add_triangles(list, 0, list.corners.size());
      list.corners = {};
    }
  }

  // ---- points ----------------------------------------------------------------------------------

  void read_vertex(const Elements *elements, uint32_t vertex, float *out) const {
    elements->read(parts_.vertices[vertex].element, out);
  }

  const VertexSource &source_of(uint32_t vertex) const {
    return parts_.sources[parts_.vertices[vertex].source];
  }

  tw_soup view_soup() const {
    return {static_cast<uint32_t>(parts_.vertices.size()),
            positions_.data(),
            static_cast<uint32_t>(faces_.count()),
            static_cast<uint32_t>(faces_.corners.size()),
            faces_.offsets.data(),
            faces_.corners.data()};
  }

  void weld() {
    uint32_t count = static_cast<uint32_t>(parts_.vertices.size()), points = 0;
    positions_.resize(3 * size_t{count});
    for (uint32_t v = 0; v < count; v++) read_vertex(source_of(v).position, v, &positions_[3 * size_t{v}]);
    point_.resize(count);
    tw_soup soup = view_soup();
    check_status(tw_weld_points(&soup, point_.data(), &points, nullptr));
    first_vertex_.resize(points);
    for (uint32_t v = count; v-- > 0;) first_vertex_[point_[v]] = v;
    mesh_.point_count = points;
  }

  // Welding may bring two corners of a face together; such a face has no place in a surface.
  void drop_pinched_faces() {
    Repeats repeats(mesh_.point_count);
    Faces kept;
    std::vector<uint32_t> points;
    size_t dropped = 0;
    for (size_t f = 0; f < faces_.count(); f++) {
      points.clear();
      for (uint32_t c = faces_.offsets[f]; c < faces_.offsets[f + 1]; c++)
        points.push_back(point_[faces_.corners[c]]);
      bool pinched = repeats.in(points.data(), points.size());
      if (pinched && dropped++ == 0) kept = first_faces(f);
      if (pinched || dropped == 0) continue;
      kept.corners.insert(kept.corners.end(), faces_.corners.begin() + faces_.offsets[f],
                          faces_.corners.begin() + faces_.offsets[f + 1]);
      kept.end_face(faces_.materials[f]);
    }
    if (dropped > 0) faces_ = std::move(kept);
    parts_.degenerate += dropped;
  }

  Faces first_faces(size_t count) const {
    Faces out;
    out.offsets.assign(faces_.offsets.begin(),
                       faces_.offsets.begin() + static_cast<std::ptrdiff_t>(count) + 1);
    out.corners.assign(faces_.corners.begin(), faces_.corners.begin() + out.offsets.back());
    out.materials.assign(faces_.materials.begin(),
                         faces_.materials.begin() + static_cast<std::ptrdiff_t>(count));
    return out;
  }

  // ---- into the model --------------------------------------------------------------------------

  void write_points() {
    float *positions = allocate<float>(document_, 3 * size_t{mesh_.point_count});
    for (uint32_t p = 0; p < mesh_.point_count; p++)
      std::memcpy(positions + 3 * size_t{p}, &positions_[3 * size_t{first_vertex_[p]}], 3 * sizeof(float));
    mesh_.positions = positions;
    bool colors = false, skin = false;
    for (const VertexSource &source : parts_.sources) {
      colors |= source.color != nullptr;
      skin |= source.joints[0] != nullptr;
      mesh_.has_tangents |= source.has_tangents;
    }
    for (const TriangleList &list : parts_.lists) mesh_.has_tangents |= bears_normal_map(list.material);
    if (colors) write_colors();
    if (skin) write_skin();
    write_morphs();
  }

  // A renderer that makes tangents up itself may make them otherwise than the map was baked for.
  bool bears_normal_map(int32_t material) const { return normal_map_of(material) >= 0; }

  int normal_map_of(int32_t material) const {
    if (material < 0) return -1;
    return normal_map_uvs(document_.model->assets->materials[static_cast<size_t>(material)]);
  }

  // Each face's tangents follow the UVs of its material's normal map, where the mesh has them.
  void choose_tangent_uvs() {
    if (!mesh_.face_materials) return;
    std::vector<uint8_t> sets(mesh_.face_count);
    bool other = false;
    for (uint32_t f = 0; f < mesh_.face_count; f++) {
      int set = normal_map_of(mesh_.face_materials[f]);
      if (set > 0 && static_cast<uint32_t>(set) < mesh_.uv_set_count) sets[f] = static_cast<uint8_t>(set);
      other |= sets[f] != 0;
    }
    if (other) mesh_.tangent_uvs = copy(document_, sets);
  }

  // Points without a colour are white, as a renderer shows them.
  void write_colors() {
    float *colors = allocate<float>(document_, 4 * size_t{mesh_.point_count});
    for (uint32_t p = 0; p < mesh_.point_count; p++) {
      float *color = colors + 4 * size_t{p};
      std::fill(color, color + 4, 1.0f);
      const Elements *elements = source_of(first_vertex_[p]).color;
      if (elements) read_vertex(elements, first_vertex_[p], color);
    }
    mesh_.colors = colors;
  }

  struct Influence {
    uint16_t joint;
    float weight;
  };

  // The four largest of up to eight weights, with sum 1. A vertex without any hangs on the first joint.
  void write_influences(uint32_t vertex, uint16_t *joints, float *weights) const {
    const VertexSource &source = source_of(vertex);
    std::array<Influence, 8> all = {};
    for (size_t set = 0; set < 2 && source.joints[set]; set++) {
      float joint[4], weight[4];
      read_vertex(source.joints[set], vertex, joint);
      read_vertex(source.weights[set], vertex, weight);
      for (size_t k = 0; k < 4; k++) {
        if (weight[k] < 0) refuse(TW_INVALID, text("/meshes/", index_), "a joint weight is negative");
        all[4 * set + k] = {static_cast<uint16_t>(joint[k]), weight[k]};
      }
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const Influence &a, const Influence &b) { return a.weight > b.weight; });
    double sum = 0;
    for (size_t k = 0; k < 4; k++) sum += all[k].weight;
    for (size_t k = 0; k < 4; k++) {
      joints[k] = all[k].weight > 0 ? all[k].joint : 0;
      weights[k] = sum > 0 ? static_cast<float>(all[k].weight / sum) : static_cast<float>(k == 0);
    }
  }

  void write_skin() {
    uint16_t *joints = allocate<uint16_t>(document_, 4 * size_t{mesh_.point_count});
    float *weights = allocate<float>(document_, 4 * size_t{mesh_.point_count});
    for (uint32_t p = 0; p < mesh_.point_count; p++)
      write_influences(first_vertex_[p], joints + 4 * size_t{p}, weights + 4 * size_t{p});
    mesh_.skin = {joints, weights};
  }

  // Targets may name the same accessors many times.
  void spend_morphs(uint64_t values) {
    if (values > document_.values_left)
      refuse(TW_LIMIT, text("/meshes/", index_), "the morph targets are too many for a file of this size");
    document_.values_left -= values;
  }

  void write_morphs() {
    size_t count = parts_.sources[0].morphs.size();
    for (const VertexSource &source : parts_.sources)
      if (source.morphs.size() != count)
        refuse(TW_INVALID, text("/meshes/", index_, "/primitives"),
               "all primitives need the same morph targets");
    if (count > TW_MORPH_TARGETS_MAX)
      refuse(TW_LIMIT, text("/meshes/", index_), "a mesh has at most ", int{TW_MORPH_TARGETS_MAX},
             " morph targets");
    spend_morphs(3 * uint64_t{count} * mesh_.point_count);
    if (count == 0) return;
    const float **morphs = allocate<const float *>(document_, count);
    for (size_t target = 0; target < count; target++) {
      float *rows = allocate<float>(document_, 3 * size_t{mesh_.point_count});
      for (uint32_t p = 0; p < mesh_.point_count; p++) {
        const Elements *elements = source_of(first_vertex_[p]).morphs[target];
        if (elements) read_vertex(elements, first_vertex_[p], rows + 3 * size_t{p});
      }
      morphs[target] = rows;
    }
    mesh_.morph_count = static_cast<uint32_t>(count);
    mesh_.morphs = morphs;
  }

  void write_morph_weights() {
    const std::vector<double> &weights = source_.weights;
    if (weights.empty()) return;
    std::string pointer = text("/meshes/", index_, "/weights");
    if (weights.size() != mesh_.morph_count)
      refuse(TW_INVALID, pointer, "there are ", weights.size(), " weights and ", mesh_.morph_count,
             " morph targets");
    float *out = allocate<float>(document_, weights.size());
    for (size_t i = 0; i < weights.size(); i++) {
      out[i] = static_cast<float>(weights[i]);
      if (!std::isfinite(out[i])) refuse(TW_INVALID, pointer, "a weight is not finite");
    }
    mesh_.morph_weights = out;
  }

  void write_faces() {
    mesh_.face_count = static_cast<uint32_t>(faces_.count());
    mesh_.corner_count = static_cast<uint32_t>(faces_.corners.size());
    mesh_.face_offsets = copy(document_, faces_.offsets);
    uint32_t *corners = allocate<uint32_t>(document_, faces_.corners.size());
    for (size_t c = 0; c < faces_.corners.size(); c++) corners[c] = point_[faces_.corners[c]];
    mesh_.corners = corners;
    bool materials =
        std::any_of(faces_.materials.begin(), faces_.materials.end(), [](int32_t m) { return m != -1; });
    if (materials) mesh_.face_materials = copy(document_, faces_.materials);
  }

  void write_uvs() {
    std::vector<float> uvs;
    for (size_t set = 0; set < TW_UV_SETS_MAX; set++) {
      bool any = false, all = true;
      for (const VertexSource &source : parts_.sources) {
        any |= source.uvs[set] != nullptr;
        all &= source.uvs[set] != nullptr;
      }
      if (!any) return; // sets are numbered without gaps
      document_.partly_textured += !all;
      read_uvs(set, uvs);
      write_uv_set(uvs);
    }
  }

  // Rows of all vertices; v up, as meshes have it.
  void read_uvs(size_t set, std::vector<float> &uvs) const {
    uvs.assign(2 * parts_.vertices.size(), 0.0f);
    for (uint32_t v = 0; v < parts_.vertices.size(); v++) {
      const Elements *elements = source_of(v).uvs[set];
      if (!elements) continue;
      float *uv = &uvs[2 * size_t{v}];
      read_vertex(elements, v, uv);
      uv[1] = 1 - uv[1];
    }
  }

  void write_uv_set(const std::vector<float> &uvs) {
    uint32_t vertices = static_cast<uint32_t>(parts_.vertices.size()), count = 0;
    std::vector<uint32_t> value(vertices);
    tw_soup soup = view_soup();
    check_status(tw_weld_uvs(&soup, point_.data(), uvs.data(), value.data(), &count, nullptr));
    float *values = allocate<float>(document_, 2 * size_t{count});
    for (uint32_t v = vertices; v-- > 0;)
      std::memcpy(values + 2 * size_t{value[v]}, &uvs[2 * size_t{v}], 2 * sizeof(float));
    uint32_t *corners = allocate<uint32_t>(document_, faces_.corners.size());
    for (size_t c = 0; c < faces_.corners.size(); c++) corners[c] = value[faces_.corners[c]];
    mesh_.uv_sets[mesh_.uv_set_count++] = {count, values, corners};
  }
};

} // namespace

void read_meshes(Document &document, Accessors &accessors) {
  size_t count = document.source.meshes.size();
  document.model->meshes = allocate<tw_mesh>(document, count);
  document.model->mesh_count = static_cast<uint32_t>(count);
  std::vector<uint32_t> scratch;
  for (size_t i = 0; i < count; i++) MeshReader(document, accessors, i, scratch).read();
  if (document.skipped_primitives > 0)
    tw_model_warn(document.model, "%zu primitives of points or lines are left out",
                  document.skipped_primitives);
  if (document.degenerate_faces > 0)
    tw_model_warn(document.model, "%zu degenerate faces are left out", document.degenerate_faces);
  if (document.partly_textured > 0)
    tw_model_warn(document.model, "%zu sets of texture coordinates are 0 0 where a primitive lacks them",
                  document.partly_textured);
}

} // namespace gltf
