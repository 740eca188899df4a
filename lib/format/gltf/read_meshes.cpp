// Meshes: one tw_mesh for each, all its triangle primitives together (glTF 2.0, section 3.7.2), welded into a
// surface. What the model keeps is written straight into its arena; scratch memory is taken from the budget,
// too.
#include "gltf/cage_tags.hpp"
#include "gltf/influences.hpp"
#include "gltf/vertex_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <set>

#include "model_checks.h"
#include "quad_pairing.h"
#include "soup_mesh.h"

namespace gltf {

namespace {

constexpr uint64_t SLOT_SIZE = 96; // bytes of an entry in the map of slots, with the allocator's own
// The triangles of a primitive, which become faces.
struct FaceList {
  uint32_t source;
  int32_t material;
  bool polygons;                   // consecutive triangles from one corner are one face
  bool holes;                      // from the mesh's tags: no primitive draws them
  int mode, indices;               // as of a primitive
  std::string pointer;             // to what names the indices
  size_t first_corner, corner_end; // of the triangles
  uint32_t face_count;
};

class MeshReader {
public:
  // skin_joints: the fewest joints of the skins that nodes give the mesh; no_skin: none does.
  MeshReader(Document &document, Accessors &accessors, size_t index, size_t skin_joints,
             Vector<uint32_t> &scratch)
      : document_(document), accessors_(accessors), source_(document.source.meshes[index]),
        texts_(document.mesh_texts[index]), index_(index), skin_joints_(skin_joints),
        mesh_(document.model->meshes[index]), pointer_(text("/meshes/", index, "/primitives/")),
        scratch_(scratch), opened_(document, accessors, index), lists_(document.budget),
        elements_(document.budget), positions_(document.budget), point_(document.budget),
        first_vertex_(document.budget), left_out_(document.budget), materials_(document.budget),
        tags_(document, accessors, index) {}

  void read() {
    document_.budget.place = text("/meshes/", index_);
    open_primitives();
    open_tags();
    read_triangles();
    check_targets();
    number_vertices();
    build_faces();
    if (!elements_.empty()) {
      weld();
      drop_doubled_corners();
      write_vertices(document_, index_, opened_, {elements_, point_, first_vertex_, view_soup(), tags_},
                     skin_joints_, !tags_.has_computed_normals());
      find_tangents();
    } else {
      count_morphs();
    }
    write_morph_weights();
    write_faces();
    if (dropped_ && !tags_.are_there()) drop_points();
    if (tags_.are_there()) write_tags();
    // A file that marks its polygons means its triangles as triangles.
    bool told = std::any_of(lists_.begin(), lists_.end(), [](const FaceList &list) { return list.polygons; });
    if (tw_quads_of(document_.quads, TW_FORMAT_GLB) == TW_QUADS_AUTO && !told) pair_triangles();
    if (mesh_.has_tangents) choose_tangent_uvs();
  }

private:
  Document &document_;
  Accessors &accessors_;
  const tinygltf::Mesh &source_;
  const MeshText &texts_;
  size_t index_, skin_joints_;
  tw_mesh &mesh_;
  std::string pointer_;
  Vector<uint32_t> &scratch_; // by element: vertex + 1; all 0 between calls
  VertexSources opened_;
  const Vector<VertexSource> &sources_ = opened_.all;
  Vector<FaceList> lists_; // in the file's order
  // First elements, at the corners of triangles; then vertices, at the corners of faces; at last points.
  uint32_t *corners_ = nullptr;
  uint32_t *offsets_ = nullptr; // of the faces
  size_t corner_count_ = 0, face_count_ = 0;
  Vector<uint32_t> elements_;     // the element of each vertex in its source
  Vector<float> positions_;       // of the vertices
  Vector<uint32_t> point_;        // of each vertex
  Vector<uint32_t> first_vertex_; // of each point
  Vector<uint8_t> left_out_;      // 1 for each face that welding leaves out
  bool dropped_ = false;          // whether faces were dropped after their vertices were numbered
  Vector<int32_t> materials_;     // of the faces while points are welded; empty where all have the same
  CageTags tags_;

  // ---- primitives ------------------------------------------------------------------------------

  // A primitive without positions draws nothing (glTF 2.0, section 3.7.2.1).
  bool is_left_out(size_t i) const { return source_.primitives[i].attributes.count("POSITION") == 0; }

  void open_primitives() {
    bool polygons = bear_polygons();
    std::set<int32_t> seen; // materials, with what else primitives have
    for (size_t i = 0; i < source_.primitives.size(); i++) {
      const tinygltf::Primitive &primitive = source_.primitives[i];
      if (primitive.mode < TINYGLTF_MODE_POINTS || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
        refuse(TW_INVALID, text(pointer_, i, "/mode"), "mode ", primitive.mode, " is out of range");
      if (is_left_out(i)) {
        document_.outline.lose("primitive without POSITION is left out",
                               "primitives without POSITION are left out");
        continue;
      }
      if (primitive.mode < TINYGLTF_MODE_TRIANGLES) continue; // passes through
      bool marked = texts_.primitives[i].bears_ngons && document_.quads != TW_QUADS_OFF;
      lists_.push_back({opened_.find(i), slot(material(primitive.material, i), i), polygons || marked, false,
                        primitive.mode, primitive.indices, text(pointer_, i), 0, 0, 0});
      if (!seen.insert(lists_.back().material).second)
        document_.outline.lose(
            "primitive becomes one with another of its mesh: they have the same material",
            "primitives become one with others of their mesh: they have the same material");
    }
  }

  // The first primitive that is read; nullptr without one.
  const tinygltf::Primitive *first_read() const {
    for (size_t i = 0; i < source_.primitives.size(); i++)
      if (!is_left_out(i)) return &source_.primitives[i];
    return nullptr;
  }

  void check_targets() const {
    for (size_t i = 0; i < source_.primitives.size(); i++)
      if (!is_left_out(i) && source_.primitives[i].targets.size() != first_read()->targets.size())
        refuse(TW_INVALID, text("/meshes/", index_, "/primitives"),
               "all primitives need the same morph targets");
  }

  // Whether all primitives of the mesh are polygons of FB_ngon_encoding, although none is marked: some
  // exporters only declare the extension.
  bool bear_polygons() const {
    const tw_gltf_objects &used = document_.assets->extensions_used;
    bool declared = std::any_of(used.items, used.items + used.count,
                                [](const char *name) { return std::strcmp(name, "FB_ngon_encoding") == 0; });
    return document_.quads != TW_QUADS_OFF && declared &&
           std::none_of(texts_.primitives.begin(), texts_.primitives.end(),
                        [](const PrimitiveText &text) { return text.bears_ngons; });
  }

  int32_t material(int index, size_t i) const {
    if (index >= -1 && (index < 0 || static_cast<uint32_t>(index) < document_.model->material_count))
      return index;
    refuse(TW_INVALID, text(pointer_, i, "/material"), "there is no material ", index);
  }

  // The value of face_materials for a primitive: its material or, if it has kept text, a slot of the two.
  int32_t slot(int32_t material, size_t i) {
    const char *preserved = texts_.primitives[i].preserved;
    if (!preserved) return material;
    Vector<tw_material_slot> &slots = document_.slots;
    auto [found, fresh] = document_.slot_numbers.try_emplace({material, preserved}, slots.size());
    if (fresh) {
      document_.budget.take(SLOT_SIZE);
      slots.push_back({material, preserved});
    }
    return static_cast<int32_t>(document_.model->material_count + found->second);
  }

  // ---- triangles -------------------------------------------------------------------------------

  // The indices of a list's corners; nullptr if the corners are the elements one after the other.
  const Elements *open_indices(const FaceList &list) {
    if (list.indices == -1) return nullptr;
    const Elements &indices = accessors_.open(list.indices, TINYGLTF_TYPE_SCALAR, list.pointer + "/indices");
    int type = indices.component_type();
    if ((type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
         type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) ||
        indices.normalized())
      refuse(TW_INVALID, text("/accessors/", list.indices, "/componentType"),
             "indices are unsigned integers");
    return &indices;
  }

  // Counts the corners of all triangles, strips and fans expanded.
  size_t count_corners(const FaceList &list) {
    const Elements *indices = open_indices(list);
    uint64_t count = indices ? indices->count() : sources_[list.source].position->count();
    bool is_list = list.mode == TINYGLTF_MODE_TRIANGLES;
    if (count < 3 || (is_list && count % 3 != 0))
      refuse(TW_INVALID, list.pointer, "the primitive's ", count, " corners make no whole triangles");
    if (!is_list) count = 3 * (count - 2);
    if (count > document_.corners_left)
      refuse(TW_LIMIT, list.pointer, "the meshes have too many triangles for a file of this size");
    document_.corners_left -= count;
    return static_cast<size_t>(count);
  }

  void read_triangles() {
    size_t most = 0;
    for (const FaceList &list : lists_) most += count_corners(list);
    corners_ = allocate<uint32_t>(document_, most);
    offsets_ = allocate<uint32_t>(document_, most / 3 + 1);
    for (FaceList &list : lists_) {
      list.first_corner = corner_count_;
      read_list(list);
      if (stands_for_nothing(list)) {
        document_.shown.add_all(*sources_[list.source].position);
        corner_count_ = list.first_corner;
      }
      list.corner_end = corner_count_;
    }
  }

  // Whether all triangles of a list are one point: answers write a mesh without faces, or without faces that
  // are drawn, in this way, as glTF has no mesh without a primitive. list: read last.
  bool stands_for_nothing(const FaceList &list) const {
    const VertexSource &source = sources_[list.source];
    const uint32_t *first = corners_ + list.first_corner, *end = corners_ + corner_count_;
    bool is_corner = std::all_of(first, end, [first](uint32_t corner) { return corner == *first; });
    return is_corner || (!source.position->has_data() && source.morphs.empty());
  }

  void read_list(const FaceList &list) {
    int mode = list.mode, accessor = list.indices;
    bool polygons = list.polygons;
    const Elements *indices = open_indices(list);
    uint32_t element_count = sources_[list.source].position->count();
    uint32_t count = indices ? indices->count() : element_count;
    auto element = [&](uint32_t k) {
      uint32_t found = indices ? indices->read_index(k) : k;
      if (found >= element_count)
        refuse(TW_INVALID, text("/accessors/", accessor), "index ", found, " at ", k,
               " is out of range: there ", tw_plural(element_count, "is", "are"), " ", element_count,
               tw_plural(element_count, " vertex", " vertices"));
      return found;
    };
    // Reads the elements one after the other: an error names the first that is wrong.
    auto triangle = [&](uint32_t first, uint32_t second, uint32_t third) {
      uint32_t a = element(first), b = element(second), c = element(third);
      add_triangle(a, b, c, polygons);
    };
    if (mode == TINYGLTF_MODE_TRIANGLES)
      for (uint32_t k = 0; k < count; k += 3) triangle(k, k + 1, k + 2);
    else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
      for (uint32_t k = 0; k + 2 < count; k++) triangle(k, k + 1 + k % 2, k + 2 - k % 2);
    else
      for (uint32_t k = 0; k + 2 < count; k++) triangle(k + 1, k + 2, 0);
  }

  // Leaves out a triangle that has a corner twice, unless it is part of a polygon (FB_ngon_encoding): a
  // polygon that comes to a vertex twice has such triangles, and would change without them.
  void add_triangle(uint32_t a, uint32_t b, uint32_t c, bool polygons) {
    if (!polygons && (a == b || b == c || c == a)) {
      document_.degenerate_faces++;
      return;
    }
    corners_[corner_count_++] = a;
    corners_[corner_count_++] = b;
    corners_[corner_count_++] = c;
  }

  // ---- vertices --------------------------------------------------------------------------------

  // Turns elements into vertices, source by source, so that one scratch numbering serves them all, in the
  // order of their first use.
  void number_vertices() {
    std::vector<uint32_t> order(lists_.size());
    for (uint32_t i = 0; i < order.size(); i++) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](uint32_t a, uint32_t b) { return lists_[a].source < lists_[b].source; });
    uint64_t most = 0;
    for (const VertexSource &source : sources_) most += source.position->count();
    elements_.reserve(static_cast<size_t>(std::min<uint64_t>(most, corner_count_)));
    auto list = order.begin();
    for (uint32_t source = 0; source < sources_.size(); source++) {
      const size_t first = elements_.size();
      opened_.all[source].first_vertex = static_cast<uint32_t>(first);
      uint32_t count = sources_[source].position->count();
      if (scratch_.size() < count) scratch_.resize(count);
      for (; list != order.end() && lists_[*list].source == source; ++list) number_list(lists_[*list]);
      for (size_t v = first; v < elements_.size(); v++) scratch_[elements_[v]] = 0;
      document_.shown.add(*sources_[source].position, elements_.data() + first, elements_.size() - first);
    }
  }

  void number_list(const FaceList &list) {
    for (size_t c = list.first_corner; c < list.corner_end; c++) {
      work(1);
      uint32_t &vertex = scratch_[corners_[c]];
      if (vertex == 0) {
        elements_.push_back(corners_[c]);
        vertex = static_cast<uint32_t>(elements_.size());
      }
      corners_[c] = vertex - 1;
    }
  }

  // ---- faces -----------------------------------------------------------------------------------

  // Where the fan that begins at `start` ends. FB_ngon_encoding: a polygon is a fan, and the next polygon
  // starts from another vertex.
  size_t fan_end(size_t start, size_t stop) const {
    size_t end = start + 3;
    while (end < stop && corners_[end] == corners_[start] && corners_[end + 1] == corners_[end - 1]) end += 3;
    return end;
  }

  void end_face(FaceList &list) {
    list.face_count++;
    offsets_[++face_count_] = static_cast<uint32_t>(corner_count_);
  }

  void keep_triangle(size_t start) {
    std::memmove(corners_ + corner_count_, corners_ + start, 3 * sizeof *corners_);
    corner_count_ += 3;
  }

  // Makes a polygon of the cage's tags in the place of its triangles, whose corners end at `end`; false, and
  // nothing is made, where it has another vertex than these.
  bool join_polygon(size_t polygon, size_t start, size_t end) {
    Vector<std::pair<uint32_t, uint32_t>> vertices(document_.budget); // by their places in the file
    for (size_t c = start; c < end; c++) vertices.emplace_back(elements_[corners_[c]], corners_[c]);
    std::sort(vertices.begin(), vertices.end());
    Vector<uint32_t> corners(document_.budget);
    for (size_t k = 0; k < tags_.polygon_size(polygon); k++) {
      uint32_t element = tags_.polygon_corner(polygon, k);
      auto found = std::lower_bound(vertices.begin(), vertices.end(), std::make_pair(element, 0u));
      if (found == vertices.end() || found->first != element) return false;
      corners.push_back(found->second);
    }
    std::copy(corners.begin(), corners.end(), corners_ + corner_count_);
    corner_count_ += corners.size();
    return true;
  }

  // Makes faces in the place of the triangles: faces never have more corners.
  void build_faces() {
    size_t polygon = 0, none = std::numeric_limits<size_t>::max();
    auto next_polygon = [&]() {
      return polygon < tags_.polygon_count() ? 3 * tags_.first_triangle(polygon) : none;
    };
    corner_count_ = 0;
    offsets_[0] = 0;
    for (FaceList &list : lists_)
      for (size_t start = list.first_corner, end; start < list.corner_end; start = end) {
        while (next_polygon() < start) polygon++;
        if (next_polygon() == start) {
          end = start + 3 * (tags_.polygon_size(polygon) - 2);
          work(end - start);
          if (end <= list.corner_end && join_polygon(polygon, start, end)) {
            end_face(list);
            continue;
          }
          polygon++;
        }
        end = list.polygons ? fan_end(start, std::min(list.corner_end, next_polygon())) : start + 3;
        work(end - start);
        keep_triangle(start);
        for (size_t k = start + 3; k < end; k += 3) corners_[corner_count_++] = corners_[k + 2];
        end_face(list);
      }
  }

  // ---- points ----------------------------------------------------------------------------------

  tw_soup view_soup() const {
    return {static_cast<uint32_t>(elements_.size()),
            positions_.data(),
            static_cast<uint32_t>(face_count_),
            static_cast<uint32_t>(corner_count_),
            offsets_,
            corners_,
            [](const void *reader, uint32_t a, uint32_t b) {
              return static_cast<const MeshReader *>(reader)->compare_motion(a, b);
            },
            this,
            materials_.empty() ? nullptr : materials_.data()};
  }

  // The materials of the faces, which tell apart layers that lie on one another.
  void list_materials() {
    bool differ = std::any_of(lists_.begin(), lists_.end(), [&](const FaceList &list) {
      return list.material != lists_[0].material || list.holes != lists_[0].holes;
    });
    if (!differ) return;
    constexpr int32_t hole = std::numeric_limits<int32_t>::min();
    materials_.reserve(face_count_);
    for (const FaceList &list : lists_)
      materials_.insert(materials_.end(), list.face_count, list.holes ? hole : list.material);
  }

  // What two vertices have of an attribute; without it, 0.
  int compare_elements(const Elements *first, uint32_t a, const Elements *second, uint32_t b) const {
    if (!first && !second) return 0;
    tw_work(1); // what welds asks whether to go on
    float rows[2][4] = {};
    if (first) first->read_finite(elements_[a], rows[0]);
    if (second) second->read_finite(elements_[b], rows[1]);
    return tw_compare_floats(rows[0], rows[1], 4);
  }

  // Orders vertices by what moves them: joints and weights, and the displacements of targets.
  int compare_motion(uint32_t a, uint32_t b) const {
    const VertexSource &first = opened_.of(a), &second = opened_.of(b);
    int order = (first.joints[0] != nullptr) - (second.joints[0] != nullptr);
    if (order == 0 && first.joints[0]) {
      const Pulls own = read_pulls(first, elements_[a]), other = read_pulls(second, elements_[b]);
      order = tw_compare_floats(own.data(), other.data(), own.size());
    }
    for (size_t target = 0; target < first.morphs.size() && order == 0; target++)
      order = compare_elements(first.morphs[target], a, second.morphs[target], b);
    return order;
  }

  void weld() {
    uint32_t count = static_cast<uint32_t>(elements_.size());
    positions_.resize(3 * size_t{count});
    for (uint32_t v = 0; v < count; v++)
      opened_.of(v).position->read(elements_[v], &positions_[3 * size_t{v}]);
    point_.resize(count);
    tw_welded welded = {};
    welded.point_count = count;
    left_out_.resize(face_count_);
    if (tags_.are_there()) {
      welded.point_count = tags_.read_points(elements_, point_);
    } else if (document_.weld == TW_WELD_NONE) {
      std::iota(point_.begin(), point_.end(), 0u);
    } else {
      list_materials();
      tw_soup soup = view_soup();
      Hold hold(document_.budget, tw_weld_size(soup.vertex_count, soup.corner_count));
      check_status(tw_weld_points(&soup, point_.data(), left_out_.data(), &welded, nullptr));
    }
    document_.degenerate_faces += welded.collapsed;
    tw_add_welded(&document_.welded, &welded);
    first_vertex_.resize(welded.point_count);
    for (uint32_t v = count; v-- > 0;) first_vertex_[point_[v]] = v;
    mesh_.point_count = welded.point_count;
    mesh_.welded_points = count - welded.point_count;
  }

  // Drops the faces that welding leaves out. Merges neighbouring corners of a face that are at one point,
  // maybe by welding, and drops faces left with fewer than three different points.
  void drop_doubled_corners() {
    Vector<uint32_t> seen(document_.budget, mesh_.point_count); // last face of each point, from 1
    uint32_t face = 0;
    uint64_t doubled = 0;
    size_t begin = 0;
    corner_count_ = face_count_ = 0;
    for (FaceList &list : lists_) {
      uint32_t count = list.face_count;
      list.face_count = 0;
      for (; count > 0; count--) {
        size_t end = offsets_[++face], start = corner_count_, different = 0;
        work(end - begin);
        if (left_out_[face - 1]) {
          begin = end;
          continue;
        }
        uint32_t before = point_[corners_[end - 1]];
        for (size_t c = begin; c < end; c++) {
          uint32_t corner = corners_[c], point = point_[corner];
          if (point != before) {
            different += seen[point] != face;
            seen[point] = face;
            corners_[corner_count_++] = corner;
          }
          before = point;
        }
        document_.degenerate_faces += different < 3;
        doubled += different >= 3 && corner_count_ - start < end - begin;
        if (different < 3)
          corner_count_ = start;
        else
          end_face(list);
        begin = end;
      }
    }
    tw_lose_doubled_corners(&document_.outline.losses, doubled);
    dropped_ = face_count_ < face;
  }

  // Drops the points that only faces left out had: each vertex is at a corner of the file.
  void drop_points() {
    Vector<uint32_t> had_face(document_.budget, mesh_.point_count, 1);
    tw_mesh_drop_points(&mesh_, had_face.data());
  }

  // ---- tags ------------------------------------------------------------------------------------

  void open_tags() {
    const char *extras = texts_.tags;
    if (!extras || document_.weld == TW_WELD_NONE || document_.quads == TW_QUADS_OFF) return;
    tags_.open(extras, sources_.size() == 1 ? sources_[0].position : nullptr);
    for (const Hole &hole : tags_.holes())
      lists_.push_back(
          {0, hole.material, true, true, TINYGLTF_MODE_TRIANGLES, hole.indices, hole.pointer, 0, 0, 0});
  }

  void write_tags() {
    uint32_t hole_faces = 0;
    for (const FaceList &list : lists_) hole_faces += list.holes ? list.face_count : 0;
    tags_.write(hole_faces);
  }

  // ---- into the model --------------------------------------------------------------------------

  // Adds the tangents that answers need for normal maps, and those that a cage was to have.
  void find_tangents() {
    bool any = std::any_of(lists_.begin(), lists_.end(),
                           [this](const FaceList &list) { return bears_normal_map(list.material); });
    mesh_.has_tangents |= tags_.had_tangents();
    mesh_.has_tangents_alone = mesh_.has_tangents && !any;
    mesh_.has_tangents |= any;
  }

  // Whether a material has a normal map. It needs tangents in the answer: a renderer that computes its own
  // may not compute those that the map was baked for.
  bool bears_normal_map(int32_t material) const { return normal_map_of(material) >= 0; }

  int normal_map_of(int32_t material) const {
    uint32_t count = document_.model->material_count;
    if (material >= 0 && static_cast<uint32_t>(material) >= count)
      material = document_.slots[static_cast<uint32_t>(material) - count].material;
    return material < 0 ? -1 : document_.normal_maps[static_cast<size_t>(material)];
  }

  // Each face's tangents follow the UVs of its material's normal map, where the mesh has them.
  void choose_tangent_uvs() {
    if (!mesh_.face_materials) return;
    uint8_t *sets = nullptr;
    for (uint32_t f = 0; f < mesh_.face_count; f++) {
      int set = normal_map_of(mesh_.face_materials[f]);
      if (set <= 0 || static_cast<uint32_t>(set) >= mesh_.uv_set_count) continue;
      if (!sets) sets = allocate_zero<uint8_t>(document_, mesh_.face_count);
      sets[f] = static_cast<uint8_t>(set);
    }
    mesh_.tangent_uvs = sets;
  }

  // The targets of a mesh without faces, of points and lines alone: they move no point of a surface, and pass
  // through, but nodes and clips have weights for them.
  void count_morphs() {
    size_t count = first_read() ? first_read()->targets.size() : 0;
    check_morph_count(count, index_);
    if (count == 0) return;
    const float **morphs = allocate<const float *>(document_, count);
    std::fill(morphs, morphs + count, allocate<float>(document_, 1));
    mesh_.morph_count = static_cast<uint32_t>(count);
    mesh_.morphs = morphs;
  }

  void write_morph_weights() {
    const std::vector<double> &weights = source_.weights;
    if (weights.empty()) return;
    std::string pointer = text("/meshes/", index_, "/weights");
    if (mesh_.morph_count == 0) {
      document_.outline.lose("mesh has morph weights and no targets: they are left out",
                             "meshes have morph weights and no targets: they are left out");
      return;
    }
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
    mesh_.face_count = static_cast<uint32_t>(face_count_);
    mesh_.corner_count = static_cast<uint32_t>(corner_count_);
    mesh_.face_offsets = offsets_;
    for (size_t c = 0; c < corner_count_; c++) corners_[c] = point_[corners_[c]];
    mesh_.corners = corners_;
    bool materials = std::any_of(lists_.begin(), lists_.end(), [](const FaceList &list) {
      return list.material != -1 && list.face_count > 0;
    });
    if (!materials) return;
    int32_t *out = allocate<int32_t>(document_, face_count_);
    mesh_.face_materials = out;
    for (const FaceList &list : lists_) out = std::fill_n(out, list.face_count, list.material);
  }

  void pair_triangles() {
    document_.budget.take(tw_pair_size(&mesh_));
    check_status(tw_pair_triangles(&mesh_, document_.model->arena, nullptr));
  }
};

// For each mesh the fewest joints of the skins that nodes give it.
Vector<size_t> count_skin_joints(Document &document) {
  Vector<size_t> fewest(document.budget, document.model->mesh_count, no_skin);
  const std::vector<tinygltf::Skin> &skins = document.source.skins;
  for (const tinygltf::Node &node : document.source.nodes) {
    if (node.mesh < 0 || static_cast<size_t>(node.mesh) >= fewest.size()) continue; // refused later on
    if (node.skin < 0 || static_cast<size_t>(node.skin) >= skins.size()) continue;
    size_t &least = fewest[static_cast<size_t>(node.mesh)];
    least = std::min(least, skins[static_cast<size_t>(node.skin)].joints.size());
  }
  return fewest;
}

} // namespace

void read_meshes(Document &document, Accessors &accessors) {
  Vector<uint32_t> scratch(document.budget);
  const Vector<size_t> skin_joints = count_skin_joints(document);
  for (uint32_t i = 0; i < document.model->mesh_count; i++)
    MeshReader(document, accessors, i, skin_joints[i], scratch).read();
  const Vector<tw_material_slot> &slots = document.slots;
  tw_material_slot *kept = allocate<tw_material_slot>(document, slots.size());
  std::copy(slots.begin(), slots.end(), kept);
  document.model->slots = kept;
  document.model->slot_count = static_cast<uint32_t>(slots.size());
  const char **names = allocate<const char *>(document, document.group_names.size());
  std::copy(document.group_names.begin(), document.group_names.end(), names);
  document.model->group_names = names;
  document.model->group_count = static_cast<uint32_t>(document.group_names.size());
  tw_model_warn_count(document.model, document.degenerate_faces, TW_COLLAPSED_FACE, TW_COLLAPSED_FACES);
  tw_model_warn_count(document.model, document.shown.missing(), "vertex is in no face: answers leave it out",
                      "vertices are in no face: answers leave them out");
  for (const std::string &fate : document.attribute_warnings)
    tw_model_warn(document.model, "the attribute %s", fate.c_str());
  tw_warn_of_welding(document.model, &document.welded);
  tw_warn_of_quads(document.model);
  tw_model_warn_count(document.model, document.partly_textured,
                      "set of texture coordinates is 0 0 where a primitive lacks it",
                      "sets of texture coordinates are 0 0 where a primitive lacks them");
}

} // namespace gltf
