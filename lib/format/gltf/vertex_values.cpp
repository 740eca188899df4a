#include "gltf/vertex_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "gltf/influences.hpp"
#include "model_checks.h"
#include "soup_mesh.h"

namespace gltf {

void check_status(tw_status status) {
  if (status != TW_OK) throw std::bad_alloc();
}

void check_morph_count(size_t count, size_t mesh) {
  if (count > TW_MORPH_TARGETS_MAX)
    refuse(TW_LIMIT, text("/meshes/", mesh), "a mesh has at most ", int{TW_MORPH_TARGETS_MAX},
           " morph targets");
}

namespace {

class ValueWriter {
public:
  ValueWriter(Document &document, size_t mesh, const VertexSources &sources, const Vertices &vertices,
              size_t skin_joints)
      : document_(document), index_(mesh), skin_joints_(skin_joints), mesh_(document.model->meshes[mesh]),
        opened_(sources), sources_(sources.all), soup_(vertices.soup), element_(vertices.element),
        point_(vertices.point), first_vertex_(vertices.first_vertex), tags_(vertices.tags) {}

  void write(bool keeps_normals) {
    write_points();
    write_uvs();
    if (keeps_normals) write_normals();
  }

private:
  Document &document_;
  size_t index_, skin_joints_;
  tw_mesh &mesh_;
  const VertexSources &opened_;
  const Vector<VertexSource> &sources_;
  const tw_soup &soup_;
  const Vector<uint32_t> &element_, &point_, &first_vertex_;
  CageTags &tags_;

  void read_vertex(const Elements *elements, uint32_t vertex, float *out) const {
    elements->read(element_[vertex], out);
  }

  void write_points() {
    float *positions = allocate<float>(document_, 3 * size_t{mesh_.point_count});
    for (uint32_t p = 0; p < mesh_.point_count; p++)
      std::memcpy(positions + 3 * size_t{p}, soup_.positions + 3 * size_t{first_vertex_[p]},
                  3 * sizeof(float));
    mesh_.positions = positions;
    // Points and lines with joints need their node's skin, which moves the faces beside them, too.
    size_t sets = mesh_.loose_has_joints && skin_joints_ < no_skin;
    bool all_skinned = true;
    for (const VertexSource &source : sources_) {
      while (sets < joint_sets && source.joints[sets]) sets++;
      all_skinned &= source.joints[0] != nullptr;
      mesh_.has_tangents |= source.tangent != nullptr;
    }
    if (sets > 0 && !all_skinned) document_.note("JOINTS_0 is joint 0 where a primitive lacks it");
    write_attributes();
    if (sets > 0) write_skin(sets);
    write_morphs();
  }

  void write_attributes() {
    tw_attribute *attributes = allocate<tw_attribute>(document_, opened_.smooth.size());
    uint32_t count = 0, columns_left = TW_ATTRIBUTE_COLUMNS_MAX - color_columns;
    for (size_t i = 0; i < opened_.smooth.size(); i++) {
      const auto &[name, width, numbers] = opened_.smooth[i];
      bool is_color = opened_.smooth[i].is_color();
      if (!is_color && width > columns_left) {
        document_.note(name + too_many_attributes());
        continue;
      }
      if (!is_color) columns_left -= width;
      tw_attribute &made = attributes[count++];
      made = {copy_name(document_, name), width, is_color, nullptr, 0, nullptr, numbers};
      write_attribute(read_attribute(i), name, made);
    }
    mesh_.attributes = attributes;
    mesh_.attribute_count = count;
  }

  static constexpr float exact_integers = 1 << 24; // floats hold all integers below

  // Rows of all vertices. Those without a colour are white, as a renderer shows them; other attributes are 0
  // there.
  Vector<float> read_attribute(size_t i) const {
    const SmoothAttribute &attribute = opened_.smooth[i];
    Vector<float> values(document_.budget, size_t{attribute.width} * element_.size(),
                         attribute.is_color() ? 1.0f : 0.0f);
    bool has_all = true, has_width = true, is_usable = true, is_within = true, is_exact = true,
         is_number = true;
    for (uint32_t v = 0; v < element_.size(); v++) {
      const VertexSource &source = opened_.of(v);
      const Elements *elements = i < source.attributes.size() ? source.attributes[i] : nullptr;
      float *value = &values[size_t{attribute.width} * v];
      has_all &= elements != nullptr;
      if (elements && attribute.is_color()) {
        work(1);
        if (!elements->read_finite(element_[v], value)) {
          std::fill(value, value + attribute.width, 1.0f);
          is_number = false;
        }
        is_within &= std::all_of(value, value + attribute.width, tw_is_color);
      } else if (elements) {
        has_width &= elements->width() == attribute.width;
        is_usable &= read_usable(*elements, element_[v], value);
        is_exact &= elements->component_type() != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT ||
                    std::all_of(value, value + elements->width(), [](float x) { return x < exact_integers; });
      }
    }
    if (!has_all)
      document_.note(attribute.name + (attribute.is_color()
                                           ? " is white and opaque where a primitive lacks it"
                                           : " is 0 where a primitive lacks it"));
    if (!has_width)
      document_.note(attribute.name + " is filled up with 0 where a primitive has fewer numbers of it");
    if (!is_number) document_.note(attribute.name + " is white and opaque where it is no number");
    if (!is_within) document_.note(attribute.name + " is brought into 0 to 1 where it is beyond");
    if (!is_usable) document_.note(attribute.name + " is 0 where it is no number up to 1e18");
    if (!is_exact) document_.note(attribute.name + " is rounded where it is 16777216 or more, as floats are");
    return values;
  }

  // Keeps one value for each point or, where vertices of one point differ, values of corners. rows: the
  // values of the vertices.
  void write_attribute(const Vector<float> &rows, const std::string &name, tw_attribute &attribute) {
    uint32_t width = attribute.width;
    if (tags_.values_of(name) || tw_values_part(point_.data(), static_cast<uint32_t>(element_.size()),
                                                first_vertex_.data(), rows.data(), width)) {
      tw_channel made = weld_values(rows, width, name);
      attribute.values = made.values;
      attribute.value_count = made.value_count;
      attribute.corners = made.corners;
      return;
    }
    float *values = allocate<float>(document_, size_t{width} * mesh_.point_count);
    for (uint32_t p = 0; p < mesh_.point_count; p++)
      std::memcpy(values + size_t{width} * p, &rows[size_t{width} * first_vertex_[p]], width * sizeof(float));
    attribute.values = values;
  }

  // Numbers the values of the vertices in the order of their first vertices, as a cage tells them apart.
  // False where vertices that share one are at two points or have two values: another program has changed
  // them.
  bool number_values(const Elements &numbers, const Vector<float> &rows, uint32_t width,
                     Vector<uint32_t> &value, uint32_t &count) const {
    Vector<uint32_t> first(document_.budget, numbers.count(), UINT32_MAX);
    for (uint32_t v = 0; v < value.size(); v++) {
      uint32_t number = numbers.read_index(element_[v]);
      work(1);
      if (number >= first.size()) return false;
      if (first[number] == UINT32_MAX) {
        first[number] = v;
        value[v] = count++;
        continue;
      }
      uint32_t other = first[number];
      value[v] = value[other];
      const float *own = &rows[size_t{width} * v], *shared = &rows[size_t{width} * other];
      if (point_[v] != point_[other] || tw_compare_floats(own, shared, width) != 0) return false;
    }
    return true;
  }

  // The values of corners of what vertices have. name: of the attribute.
  tw_channel weld_values(const Vector<float> &rows, uint32_t width, const std::string &name) {
    uint32_t vertices = static_cast<uint32_t>(element_.size()), count = 0;
    Vector<uint32_t> value(document_.budget, vertices);
    const Elements *told = tags_.values_of(name);
    bool is_told = told && number_values(*told, rows, width, value, count);
    if (told && !is_told) tags_.warn_of_values(name);
    if (!is_told) {
      Hold hold(document_.budget, tw_weld_size(soup_.vertex_count, soup_.corner_count));
      check_status(tw_weld_values(&soup_, point_.data(), mesh_.point_count, rows.data(), width, value.data(),
                                  &count, nullptr));
    }
    float *values = allocate<float>(document_, size_t{width} * count);
    for (uint32_t v = vertices; v-- > 0;)
      std::memcpy(values + size_t{width} * value[v], &rows[size_t{width} * v], width * sizeof(float));
    uint32_t *corners = allocate<uint32_t>(document_, soup_.corner_count);
    for (size_t c = 0; c < soup_.corner_count; c++) corners[c] = value[soup_.corners[c]];
    return {width, count, values, corners, false};
  }

  // Reads an element; false and all 0 if a value cannot be subdivided, because it is not finite or over
  // TW_COORDINATE_MAX.
  static bool read_usable(const Elements &elements, uint32_t i, float *out) {
    work(1);
    bool usable = elements.read_finite(i, out) && std::all_of(out, out + elements.width(), [](float x) {
                    return std::abs(x) <= TW_COORDINATE_MAX;
                  });
    if (!usable) std::fill(out, out + elements.width(), 0.0f);
    return usable;
  }

  // How far from 1 the sum of a point's weights may be without a word: weights of bytes are rounded.
  static constexpr double sum_tolerance = 0.01;

  // sets: of joints, the most that a primitive has.
  void write_skin(size_t sets) {
    size_t width = 4 * sets;
    if (sets > 1)
      document_.spend_values(2 * uint64_t{width} * mesh_.point_count, text("/meshes/", index_),
                             "joint weights");
    uint16_t *joints = allocate<uint16_t>(document_, width * mesh_.point_count);
    float *weights = allocate<float>(document_, width * mesh_.point_count);
    uint64_t scaled = 0, without = 0, stray = 0;
    for (uint32_t p = 0; p < mesh_.point_count; p++) {
      const uint32_t vertex = first_vertex_[p];
      const Influences all = read_influences(opened_.of(vertex), element_[vertex], index_);
      double sum = write_influences(all, width, joints + width * p, weights + width * p);
      stray += std::any_of(all.begin(), all.end(), [&](const Influence &one) {
        return one.joint >= skin_joints_ && !(one.weight > 0); // others are refused when skins are read
      });
      without += !(sum > 0);
      scaled += sum > 0 && std::abs(sum - 1) > sum_tolerance;
    }
    document_.outline.lose("point without joint weights follows the first joint",
                           "points without joint weights follow the first joint", without);
    document_.outline.lose("point has joint weights whose sum is not 1: they are scaled to it",
                           "points have joint weights whose sum is not 1: they are scaled to it", scaled);
    document_.outline.lose("point names a joint that its skin has not: left out, as its weight is 0",
                           "points name joints that their skins have not: left out, as their weights are 0",
                           stray);
    mesh_.skin = {static_cast<uint32_t>(width), joints, weights};
  }

  // Counts values of targets, which may name the same accessors many times.
  void spend_morphs(uint64_t values) {
    document_.spend_values(values, text("/meshes/", index_), "the morph targets");
  }

  void write_morphs() {
    size_t count = sources_[0].morphs.size();
    check_morph_count(count, index_);
    spend_morphs(3 * uint64_t{count} * mesh_.point_count);
    if (count == 0) return;
    const float **morphs = allocate<const float *>(document_, count);
    for (size_t target = 0; target < count; target++) {
      float *rows = allocate_zero<float>(document_, 3 * size_t{mesh_.point_count});
      for (uint32_t p = 0; p < mesh_.point_count; p++) {
        const Elements *elements = opened_.of(first_vertex_[p]).morphs[target];
        if (elements) read_vertex(elements, first_vertex_[p], rows + 3 * size_t{p});
      }
      morphs[target] = rows;
    }
    mesh_.morph_count = static_cast<uint32_t>(count);
    mesh_.morphs = morphs;
  }

  // How many sets of texture coordinates there are, those between them that no primitive has included.
  size_t count_uv_sets() const {
    size_t count = 0;
    for (const VertexSource &source : sources_)
      for (size_t set = count; set < TW_UV_SETS_MAX; set++)
        if (source.uvs[set]) count = set + 1;
    return count;
  }

  // Sets are numbered without gaps: one that no primitive has is 0 0 if a further one exists, so that
  // materials find theirs under its number.
  void write_uvs() {
    size_t count = count_uv_sets();
    for (size_t set = 0; set < count; set++) {
      bool any = false, all = true;
      for (const VertexSource &source : sources_) {
        any |= source.uvs[set] != nullptr;
        all &= source.uvs[set] != nullptr;
      }
      if (!any) document_.note(text("TEXCOORD_", set, " is added, all 0 0: there are further sets"));
      document_.partly_textured += any && !all;
      tw_channel made = weld_values(read_uvs(set), 2, text("TEXCOORD_", set));
      mesh_.uv_sets[mesh_.uv_set_count++] = {made.value_count, made.values, made.corners};
    }
    for (const VertexSource &source : sources_)
      if (source.tangent && count == 0)
        document_.note("TANGENT is left out: there are no texture coordinates that it follows");
      else if (source.tangent && !source.normal)
        document_.note("TANGENT is computed anew: there is no NORMAL beside it");
  }

  // Texture coordinates of all vertices, v up, as meshes have them. A vertex whose primitive has none gets
  // the 0 0 of glTF, v down.
  Vector<float> read_uvs(size_t set) const {
    Vector<float> uvs(document_.budget, 2 * element_.size(), 0.0f);
    uint64_t unusable = 0;
    for (uint32_t v = 0; v < element_.size(); v++) {
      const Elements *elements = opened_.of(v).uvs[set];
      float *uv = &uvs[2 * size_t{v}];
      if (elements) unusable += !read_usable(*elements, element_[v], uv);
      uv[1] = 1 - uv[1];
    }
    document_.outline.lose("texture coordinate is 0 0: it has no numbers up to 1e18",
                           "texture coordinates are 0 0: they are no numbers up to 1e18", unusable);
    return uvs;
  }

  // What becomes of normals and tangents that are no directions of unit length.
  struct DirectionLosses {
    uint64_t bad = 0, zero = 0, scaled = 0;
  };

  // Reads a normal or a tangent; one that is not finite becomes 0 0 0, which means none.
  static void read_direction(const Elements &elements, uint32_t i, float *out, DirectionLosses &losses) {
    bool is_finite = elements.read_finite(i, out);
    double length = std::hypot(double{out[0]}, double{out[1]}, double{out[2]});
    losses.bad += !is_finite;
    losses.zero += is_finite && length == 0;
    losses.scaled += length > 0 && tw_is_off_unit(length);
  }

  // Keeps a normal for each vertex, not for each point.
  void write_normals() {
    bool normals = false, tangents = false;
    for (const VertexSource &source : sources_) {
      normals |= source.normal != nullptr;
      tangents |= source.normal && source.tangent;
    }
    if (!normals || soup_.corner_count == 0) return;
    size_t count = element_.size();
    float *values = allocate_zero<float>(document_, 3 * count);
    float *rows = tangents ? allocate_zero<float>(document_, 4 * count) : nullptr;
    DirectionLosses losses;
    uint64_t handless = 0;
    for (uint32_t v = 0; v < count; v++) {
      work(1);
      const VertexSource &source = opened_.of(v);
      if (!source.normal) continue;
      read_direction(*source.normal, element_[v], values + 3 * size_t{v}, losses);
      if (!source.tangent) continue;
      float *tangent = rows + 4 * size_t{v};
      read_direction(*source.tangent, element_[v], tangent, losses);
      handless += tw_is_off_unit(std::abs(double{tangent[3]}));
    }
    document_.outline.lose("normal or tangent is left out: it is not finite",
                           "normals and tangents are left out: they are not finite", losses.bad);
    document_.outline.lose("normal or tangent is 0 0 0, and computed in its place",
                           "normals and tangents are 0 0 0, and computed in their place", losses.zero);
    document_.outline.lose("normal or tangent is not of unit length: it is scaled to it",
                           "normals and tangents are not of unit length: they are scaled to it",
                           losses.scaled);
    document_.outline.lose("tangent has another fourth number than 1 or -1: its sign counts",
                           "tangents have other fourth numbers than 1 or -1: their signs count", handless);
    uint32_t *corners = allocate<uint32_t>(document_, soup_.corner_count);
    std::copy(soup_.corners, soup_.corners + soup_.corner_count, corners);
    mesh_.normals = {static_cast<uint32_t>(count), values, rows, corners};
    write_morph_normals();
  }

  // The most bytes of displaced normals: for each target a surface holds the normals of answers
  // (tw_surface_morph).
  static constexpr uint64_t morph_normals_max = uint64_t{128} << 20;

  void write_morph_normals() {
    bool any = false;
    for (const VertexSource &source : sources_)
      any |= std::any_of(source.morph_normals.begin(), source.morph_normals.end(),
                         [](const Elements *elements) { return elements != nullptr; });
    if (!any) return;
    uint64_t numbers = 3 * uint64_t{mesh_.morph_count} * mesh_.normals.value_count;
    uint64_t held = sizeof(float) * 3 * uint64_t{mesh_.morph_count} * soup_.corner_count;
    if (held > morph_normals_max || numbers > document_.values_left ||
        sizeof(float) * numbers > document_.budget.left() / 2) {
      document_.note("NORMAL of morph targets is left out: there are too many");
      return;
    }
    spend_morphs(numbers);
    const float **out = allocate<const float *>(document_, mesh_.morph_count);
    uint64_t unusable = 0;
    for (size_t target = 0; target < mesh_.morph_count; target++) {
      float *rows = allocate_zero<float>(document_, 3 * size_t{mesh_.normals.value_count});
      for (uint32_t v = 0; v < mesh_.normals.value_count; v++) {
        const Elements *elements = opened_.of(v).morph_normals[target];
        if (elements) unusable += !read_usable(*elements, element_[v], rows + 3 * size_t{v});
      }
      out[target] = rows;
    }
    document_.outline.lose("NORMAL of a morph target is 0 0 0: it has no numbers up to 1e18",
                           "NORMALs of morph targets are 0 0 0: they are no numbers up to 1e18", unusable);
    mesh_.morph_normals = out;
  }
};

} // namespace

void write_vertices(Document &document, size_t mesh, const VertexSources &sources, const Vertices &vertices,
                    size_t skin_joints, bool keeps_normals) {
  ValueWriter(document, mesh, sources, vertices, skin_joints).write(keeps_normals);
}

} // namespace gltf
