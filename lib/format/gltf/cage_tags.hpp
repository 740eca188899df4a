// Reads extras.tweend of a mesh, in which an answer says of a cage what glTF cannot, see tw_gltf_stream.
#ifndef TWEEND_GLTF_CAGE_TAGS_HPP
#define TWEEND_GLTF_CAGE_TAGS_HPP

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gltf/document.hpp"

namespace gltf {

// Faces that are drawn by no primitive.
struct Hole {
  int indices; // accessor, of triangles
  int32_t material;
  std::string pointer;
};

class CageTags {
public:
  CageTags(Document &document, Accessors &accessors, size_t mesh)
      : document_(document), accessors_(accessors), index_(mesh), mesh_(document.model->meshes[mesh]),
        holes_(document.budget), polygons_(document.budget) {}

  // Opens the accessors that the extras name. positions: of all vertices, nullptr if primitives have
  // different ones. Another program may have kept the extras and changed the accessors: tags that do not fit
  // are left out, with a warning.
  void open(const char *extras, const Elements *positions) {
    try {
      const char *creases = tw_json_member(extras, "creases"), *corners = tw_json_member(extras, "corners");
      text_ = extras;
      points_ = open_tag(extras, "points", false);
      faces_ = open_tag(extras, "faces", false);
      starts_ = open_tag(extras, "starts", false);
      groups_ = open_tag(tw_json_member(extras, "groups"), "faces", false);
      open_polygons(tw_json_member(extras, "polygons"));
      crease_edges_ = open_tag(creases, "edges", false);
      crease_sharpness_ = open_tag(creases, "sharpness", true);
      corner_vertices_ = open_tag(corners, "vertices", false);
      corner_sharpness_ = open_tag(corners, "sharpness", true);
      check_points(positions);
      open_values(tw_json_member(extras, "values"));
      open_holes(tw_json_member(extras, "holes"), *positions);
      open_details(tw_json_member(extras, "details"));
    } catch (const Refusal &refusal) {
      leave_out(refusal);
    }
  }

  bool are_there() const { return points_ != nullptr; }
  // Whether the cage had no normals: those of the file were computed, and show no edge as hard or smooth.
  bool has_computed_normals() const {
    return are_there() && index_of(tw_json_member(text_, "computed_normals")) == 1;
  }

  // Whether the cage was to have tangents, which need normals that the file lacks.
  bool had_tangents() const { return are_there() && index_of(tw_json_member(text_, "tangents")) == 1; }

  // The polygons that are no fan from any corner, by their triangles: each of these is a face of its own in
  // the file.
  size_t polygon_count() const { return are_there() ? polygons_.size() : 0; }
  // The number of a polygon's first triangle in the mesh, and how many corners it has.
  size_t first_triangle(size_t polygon) const { return polygons_[polygon].triangle; }
  size_t polygon_size(size_t polygon) const { return polygons_[polygon].size; }
  // The place in the file of the vertex at a corner.
  uint32_t polygon_corner(size_t polygon, size_t corner) const {
    return polygon_corners_->read_index(static_cast<uint32_t>(polygons_[polygon].first_corner + corner));
  }
  const Vector<Hole> &holes() const { return holes_; }

  // Sets each vertex's point and returns how many points there are. Every point must have a face. elements:
  // of each vertex its place in the file. point: [vertices].
  uint32_t read_points(const Vector<uint32_t> &elements, Vector<uint32_t> &point) {
    Vector<uint8_t> has_face(document_.budget, points_->count(), 0);
    for (size_t v = 0; v < elements.size(); v++) has_face[point[v] = points_->read_index(elements[v])] = 1;
    for (uint32_t vertex = 0; vertex < points_->count(); vertex++)
      if (uint32_t named = points_->read_index(vertex); !has_face[named])
        refuse(TW_INVALID, place_of("points"), "point ", named, " is that of vertex ", vertex,
               ", and no face has it");
    point_count_ = static_cast<uint32_t>(std::count(has_face.begin(), has_face.end(), 1));
    return point_count_;
  }

  // The number of each vertex's value of an attribute, by the places of vertices in the file; nullptr where
  // equal values are one.
  const Elements *values_of(const std::string &attribute) const {
    auto found = values_.find(attribute);
    return are_there() && found != values_.end() ? found->second : nullptr;
  }

  void warn_of_values(const std::string &attribute) {
    tw_model_warn(document_.model,
                  "extras.tweend of mesh %zu: the values of %s are left out: they are others", index_,
                  attribute.c_str());
  }

  // Puts faces and corners into the order that the mesh had, and tags it. The mesh must have the faces of the
  // file, the last `hole_faces` of which are holes.
  void write(uint32_t hole_faces) {
    Vector<uint32_t> place(document_.budget, mesh_.face_count, 0);
    try {
      check_sharpness("creases", crease_edges_, crease_sharpness_, 2);
      check_sharpness("corners", corner_vertices_, corner_sharpness_, 1);
      read_face_order(place);
      check_starts();
      check_details();
      write_groups(place);
    } catch (const Refusal &refusal) {
      std::iota(place.begin(), place.end(), 0u);
      write_holes(place, hole_faces);
      return leave_out(refusal);
    }
    write_holes(place, hole_faces);
    reorder_faces(place);
    mesh_.crease_count =
        write_sharpness(crease_edges_, crease_sharpness_, mesh_.crease_edges, mesh_.crease_sharpness);
    mesh_.sharp_point_count =
        write_sharpness(corner_vertices_, corner_sharpness_, mesh_.sharp_points, mesh_.point_sharpness);
    write_rules();
    write_details();
  }

private:
  Document &document_;
  Accessors &accessors_;
  size_t index_;
  tw_mesh &mesh_;
  const char *text_ = nullptr;
  // nullptr where the extras do not say.
  const Elements *points_ = nullptr, *faces_ = nullptr, *starts_ = nullptr, *groups_ = nullptr;
  const Elements *crease_edges_ = nullptr, *crease_sharpness_ = nullptr, *corner_vertices_ = nullptr,
                 *corner_sharpness_ = nullptr;
  std::vector<std::pair<uint32_t, const Elements *>> details_; // a level, its offsets
  std::map<std::string, const Elements *> values_;
  Vector<Hole> holes_;
  struct Polygon {
    size_t triangle, size, first_corner;
  };
  Vector<Polygon> polygons_; // by ascending triangles
  const Elements *polygon_corners_ = nullptr;
  uint32_t point_count_ = 0; // set by read_points

  std::string place_of(const char *name) const { return text("/meshes/", index_, "/extras/tweend/", name); }

  // Opens the accessor that a member names; nullptr without one.
  const Elements *open_tag(const char *object, const char *name, bool is_float) {
    const char *index = tw_json_member(object, name);
    if (!index) return nullptr;
    const Elements &elements = accessors_.open(index_of(index), TINYGLTF_TYPE_SCALAR, place_of(name));
    int wanted = is_float ? TINYGLTF_COMPONENT_TYPE_FLOAT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    if (elements.component_type() != wanted)
      refuse(TW_INVALID, place_of(name), name, " are of another component type");
    return &elements;
  }

  // Checks that polygons follow each other and have as many corners as there are.
  void open_polygons(const char *polygons) {
    if (!polygons) return;
    const Elements *triangles = open_tag(polygons, "triangles", false),
                   *sizes = open_tag(polygons, "sizes", false);
    polygon_corners_ = open_tag(polygons, "corners", false);
    std::string pointer = place_of("polygons");
    if (!triangles || !sizes || !polygon_corners_ || triangles->count() != sizes->count())
      refuse(TW_INVALID, pointer, "there are not as many sizes as first triangles");
    document_.spend_values(2 * uint64_t{sizes->count()} + polygon_corners_->count(), pointer,
                           "the polygons of cages");
    size_t corners = 0, end = 0;
    for (uint32_t i = 0; i < sizes->count(); i++) {
      size_t first = triangles->read_index(i), size = sizes->read_index(i);
      work(1);
      if (size < 4 || first < end || size > polygon_corners_->count() - corners)
        refuse(TW_INVALID, pointer, "polygon ", i, " is out of order or too large");
      polygons_.push_back({first, size, corners});
      corners += size;
      end = first + size - 2;
    }
    if (corners != polygon_corners_->count()) refuse(TW_INVALID, pointer, "a corner is in no polygon");
  }

  // Checks that every vertex has a point, every point a vertex, and the vertices of a point one place.
  void check_points(const Elements *positions) const {
    std::string pointer = place_of("points");
    if (!points_ || !positions || points_->count() != positions->count())
      refuse(TW_INVALID, pointer, "there are not as many points as vertices");
    uint32_t count = points_->count();
    document_.spend_values(4 * uint64_t{count}, pointer, "the points of cages"); // with their positions
    Vector<uint32_t> vertex(document_.budget, count, UINT32_MAX);                // of each point
    uint32_t found = 0, last = 0;
    for (uint32_t v = 0; v < count; v++) {
      uint32_t point = points_->read_index(v);
      if (point >= count) refuse(TW_INVALID, pointer, "point ", point, " is out of range");
      last = std::max(last, point);
      found += vertex[point] == UINT32_MAX;
      if (vertex[point] == UINT32_MAX) vertex[point] = v;
      float own[3], first[3];
      positions->read(v, own);
      positions->read(vertex[point], first);
      if (!std::equal(own, own + 3, first)) refuse(TW_INVALID, pointer, "a point is at two places");
    }
    if (found != last + 1) refuse(TW_INVALID, pointer, "a point has no vertex");
  }

  void open_values(const char *values) {
    if (!values || *values != '{') return;
    for (Items item(values); item.more(); item.next()) {
      std::string pointer = place_of("values");
      const Elements &numbers = accessors_.open(index_of(item.value()), TINYGLTF_TYPE_SCALAR, pointer);
      if (numbers.component_type() != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT ||
          numbers.count() != points_->count())
        refuse(TW_INVALID, pointer, "there are not as many values as vertices");
      document_.spend_values(numbers.count(), pointer, "the values of cages");
      values_[unescape(item.key())] = &numbers;
    }
  }

  void open_holes(const char *holes, const Elements &positions) {
    if (!holes || *holes != '[') return;
    size_t i = 0;
    for (Items item(holes); item.more(); item.next(), i++) {
      std::string pointer = text(place_of("holes"), "/", i);
      if (*item.value() != '{') refuse(TW_INVALID, pointer, "a hole is no object");
      int indices = index_of(tw_json_member(item.value(), "indices")),
          found = index_of(tw_json_member(item.value(), "material"));
      if (found >= 0 && static_cast<uint32_t>(found) >= document_.model->material_count)
        refuse(TW_INVALID, pointer, "there is no material ", found);
      const Elements &elements = accessors_.open(indices, TINYGLTF_TYPE_SCALAR, pointer + "/indices");
      if (elements.count() % 3 != 0 || elements.component_type() == TINYGLTF_COMPONENT_TYPE_FLOAT)
        refuse(TW_INVALID, pointer, "holes are no triangles");
      document_.spend_values(elements.count(), pointer, "the indices of holes");
      for (uint32_t k = 0; k < elements.count(); k++)
        if (elements.read_index(k) >= positions.count())
          refuse(TW_INVALID, pointer, "an index is out of range");
      holes_.push_back({indices, found, pointer});
    }
  }

  void open_details(const char *details) {
    if (!details || *details != '[') return;
    uint32_t above = 0;
    for (Items item(details); item.more(); item.next()) {
      std::string pointer = text(place_of("details"), "/", details_.size());
      uint32_t level = static_cast<uint32_t>(index_of(tw_json_member(item.value(), "level")));
      if (level <= above || level > TW_LEVEL_MAX)
        refuse(TW_INVALID, pointer, "levels of details ascend from 1 to ", int{TW_LEVEL_MAX});
      above = level;
      const Elements &offsets = accessors_.open(index_of(tw_json_member(item.value(), "offsets")),
                                                TINYGLTF_TYPE_VEC3, pointer + "/offsets");
      if (offsets.component_type() != TINYGLTF_COMPONENT_TYPE_FLOAT)
        refuse(TW_INVALID, pointer, "offsets are of another component type");
      document_.spend_values(3 * uint64_t{offsets.count()}, pointer, "the details");
      details_.emplace_back(level, &offsets);
    }
  }

  // place: [face of the mesh] its place in the file.
  void read_face_order(Vector<uint32_t> &place) const {
    uint32_t count = mesh_.face_count;
    if (!faces_) return std::iota(place.begin(), place.end(), 0u);
    if (faces_->count() != count) refuse(TW_INVALID, place_of("faces"), "there are not as many faces");
    std::fill(place.begin(), place.end(), UINT32_MAX);
    for (uint32_t i = 0; i < count; i++) {
      uint32_t face = faces_->read_index(i);
      if (face >= count || place[face] != UINT32_MAX)
        refuse(TW_INVALID, place_of("faces"), "faces are in no order");
      place[face] = i;
    }
  }

  // Checks that each face of the file begins with one of its own corners.
  void check_starts() const {
    if (!starts_) return;
    if (starts_->count() != mesh_.face_count)
      refuse(TW_INVALID, place_of("starts"), "there are not as many starts as faces");
    for (uint32_t f = 0; f < mesh_.face_count; f++)
      if (starts_->read_index(f) >= mesh_.face_offsets[f + 1] - mesh_.face_offsets[f])
        refuse(TW_INVALID, place_of("starts"), "a face has no such corner");
  }

  static bool is_identity(const Vector<uint32_t> &place) {
    for (size_t i = 0; i < place.size(); i++)
      if (place[i] != i) return false;
    return true;
  }

  // Puts values of corners into the new order of faces, from each face's first corner on.
  void reorder_corners(const uint32_t *&values, const Vector<uint32_t> &place) {
    if (!values) return;
    uint32_t *out = allocate<uint32_t>(document_, mesh_.corner_count), *next = out;
    for (uint32_t from : place) {
      const uint32_t *first = values + mesh_.face_offsets[from],
                     *last = values + mesh_.face_offsets[from + 1];
      uint32_t start = starts_ ? starts_->read_index(from) : 0;
      next = std::rotate_copy(first, start ? last - start : first, last, next);
    }
    values = out;
  }

  void reorder_faces(const Vector<uint32_t> &place) {
    if (is_identity(place) && !starts_) return;
    reorder_corners(mesh_.corners, place);
    reorder_corners(mesh_.normals.corners, place);
    for (uint32_t set = 0; set < mesh_.uv_set_count; set++)
      reorder_corners(mesh_.uv_sets[set].corners, place);
    // The reader has just made the attributes, and nothing else refers to them.
    for (uint32_t i = 0; i < mesh_.attribute_count; i++)
      reorder_corners(const_cast<tw_attribute *>(mesh_.attributes)[i].corners, place);
    uint32_t *offsets = allocate<uint32_t>(document_, place.size() + 1);
    offsets[0] = 0;
    for (size_t i = 0; i < place.size(); i++)
      offsets[i + 1] = offsets[i] + mesh_.face_offsets[place[i] + 1] - mesh_.face_offsets[place[i]];
    mesh_.face_offsets = offsets;
    if (!mesh_.face_materials) return;
    int32_t *materials = allocate<int32_t>(document_, place.size());
    for (size_t i = 0; i < place.size(); i++) materials[i] = mesh_.face_materials[place[i]];
    mesh_.face_materials = materials;
  }

  // Checks elements of `width` points each, and their sharpness.
  void check_sharpness(const char *name, const Elements *points, const Elements *sharpness,
                       uint32_t width) const {
    if (!points != !sharpness || (points && points->count() != uint64_t{width} * sharpness->count()))
      refuse(TW_INVALID, place_of(name), "there are not as many ", name, " as their sharpness");
    if (points)
      document_.spend_values(uint64_t{points->count()} + sharpness->count(), place_of(name), "tags of cages");
    for (uint32_t i = 0; points && i < points->count(); i++)
      if (points->read_index(i) >= point_count_)
        refuse(TW_INVALID, place_of(name), "a point of ", name, " is out of range");
    for (uint32_t i = 0; sharpness && i < sharpness->count(); i++) {
      float value;
      work(1);
      if (!sharpness->read_finite(i, &value) || value < 0)
        refuse(TW_INVALID, place_of(name), "sharpness is a number from 0");
    }
  }

  // Writes elements of points->count() / sharpness->count() points each, and returns how many there are.
  uint32_t write_sharpness(const Elements *points, const Elements *sharpness, const uint32_t *&to,
                           const float *&sharpness_to) {
    if (!points || sharpness->count() == 0) return 0;
    uint32_t *indices = allocate<uint32_t>(document_, points->count());
    float *values = allocate<float>(document_, sharpness->count());
    for (uint32_t i = 0; i < points->count(); i++) indices[i] = points->read_index(i);
    for (uint32_t i = 0; i < sharpness->count(); i++) {
      sharpness->read(i, values + i);
      values[i] = std::min(values[i], TW_SHARPNESS_INFINITE);
    }
    to = indices;
    sharpness_to = values;
    return sharpness->count();
  }

  // Tags the last `count` faces of the file as holes.
  void write_holes(const Vector<uint32_t> &place, uint32_t count) {
    uint32_t first = mesh_.face_count - count;
    if (count == 0) return;
    uint32_t *holes = allocate<uint32_t>(document_, count), *next = holes;
    for (uint32_t f = 0; f < mesh_.face_count; f++)
      if (place[f] >= first) *next++ = f;
    mesh_.holes = holes;
    mesh_.hole_count = count;
  }

  // The number of a set of groups in the whole model, by its names.
  uint32_t group_number(const std::string &name) {
    constexpr size_t sets_max = 1 << 18, entry_size = 96;
    auto [found, fresh] = document_.group_numbers.try_emplace(name, document_.group_names.size());
    if (!fresh) return found->second;
    document_.budget.take(entry_size + name.size());
    const char *copy = copy_name(document_, name);
    if (!copy || document_.group_names.size() == sets_max)
      refuse(TW_LIMIT, place_of("groups"), "a name of groups is empty, or there are too many");
    document_.group_names.push_back(copy);
    return found->second;
  }

  void write_groups(const Vector<uint32_t> &place) {
    if (!groups_) return;
    std::string pointer = place_of("groups");
    const char *groups = tw_json_member(text_, "groups"), *names = tw_json_member(groups, "names");
    if (groups_->count() != mesh_.face_count || !names || *names != '[')
      refuse(TW_INVALID, pointer, "there are not as many groups as faces");
    Vector<uint32_t> numbers(document_.budget);
    for (Items name(names); name.more(); name.next()) {
      if (*name.value() != '"') refuse(TW_INVALID, pointer, "a name of groups is no text");
      numbers.push_back(group_number(unescape(string_of(name.value()))));
    }
    uint32_t *out = allocate<uint32_t>(document_, mesh_.face_count);
    for (uint32_t f = 0; f < mesh_.face_count; f++) {
      uint32_t group = groups_->read_index(place[f]);
      if (group != UINT32_MAX && group >= numbers.size())
        refuse(TW_INVALID, pointer, "group ", group, " has no name");
      out[f] = group == UINT32_MAX ? group : numbers[group];
    }
    mesh_.face_groups = out;
  }

  static int rule(const char *rules, const char *name, int most) {
    int value = index_of(tw_json_member(rules, name));
    return value >= 0 && value <= most ? value : static_cast<int>(TW_TAG_UNSET);
  }

  void write_rules() {
    const char *rules = tw_json_member(text_, "rules");
    mesh_.tag_boundary = rule(rules, "boundary", TW_BOUNDARY_NONE);
    mesh_.tag_uv = rule(rules, "uv", TW_UV_ALL);
    mesh_.tag_creasing = rule(rules, "creasing", TW_CREASE_CHAIKIN);
    mesh_.tag_triangles = rule(rules, "triangles", TW_TRIANGLES_SMOOTH);
  }

  void check_details() const {
    for (const auto &[level, offsets] : details_)
      for (uint32_t i = 0; i < offsets->count(); i++) {
        float row[3];
        work(1);
        if (!offsets->read_finite(i, row) ||
            std::any_of(row, row + 3, [](float x) { return std::abs(x) > TW_COORDINATE_MAX; }))
          refuse(TW_INVALID, place_of("details"), "an offset of level ", level, " is no number up to 1e18");
      }
  }

  void write_details() {
    tw_detail *details = allocate<tw_detail>(document_, details_.size());
    for (size_t i = 0; i < details_.size(); i++) {
      const auto &[level, offsets] = details_[i];
      float *rows = allocate<float>(document_, 3 * size_t{offsets->count()});
      for (uint32_t v = 0; v < offsets->count(); v++) offsets->read(v, rows + 3 * size_t{v});
      details[i] = {level, offsets->count(), rows};
    }
    mesh_.details = details;
    mesh_.detail_count = static_cast<uint32_t>(details_.size());
  }

  void leave_out(const Refusal &refusal) {
    tw_model_warn(document_.model, "extras.tweend of mesh %zu are left out: %s", index_,
                  refusal.detail.c_str());
    points_ = nullptr;
    holes_.clear();
  }
};

} // namespace gltf

#endif
