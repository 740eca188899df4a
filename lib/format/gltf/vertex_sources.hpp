// The attributes that the primitives of a mesh name.
#ifndef TWEEND_GLTF_VERTEX_SOURCES_HPP
#define TWEEND_GLTF_VERTEX_SOURCES_HPP

#include <algorithm>
#include <array>

#include "gltf/document.hpp"

namespace gltf {

using Attributes = std::map<std::string, int>;

// The most sets of joints, of four each.
constexpr size_t joint_sets = TW_JOINT_SETS_MAX;

// The attributes of a primitive, opened. Primitives that name the same accessors share one.
struct VertexSource {
  const Elements *position = nullptr;
  std::array<const Elements *, TW_UV_SETS_MAX> uvs = {};
  const Elements *normal = nullptr, *tangent = nullptr;
  std::vector<const Elements *> attributes; // one for each smooth attribute, as far as it has them
  std::array<const Elements *, joint_sets> joints = {}, weights = {}; // without gaps
  // An entry is nullptr for a target that moves no point, or no normal.
  std::vector<const Elements *> morphs, morph_normals;
  uint32_t first_vertex = 0; // vertices are numbered source by source
};

// An attribute that is subdivided with the points: a colour, or an application's own. It is the same in all
// primitives that have it.
struct SmoothAttribute {
  std::string name;
  uint32_t width;
  tw_numbers numbers;
  bool is_color() const { return name[0] != '_'; }
};

// Columns that are kept free for a colour.
constexpr int color_columns = 4;

// What is said of an attribute that finds no room.
inline std::string too_many_attributes() {
  return text(" is left out: a mesh keeps ", TW_ATTRIBUTES_MAX - 1, " such, of ",
              TW_ATTRIBUTE_COLUMNS_MAX - color_columns, " components in all");
}

class VertexSources {
public:
  VertexSources(Document &document, Accessors &accessors, size_t mesh)
      : all(document.budget), document_(document), accessors_(accessors),
        source_(document.source.meshes[mesh]), index_(mesh),
        pointer_(text("/meshes/", mesh, "/primitives/")) {}

  // The index in `all` of primitive i's source.
  uint32_t find(size_t i) {
    const tinygltf::Primitive &primitive = source_.primitives[i];
    auto [found, fresh] =
        known_.try_emplace(Key(primitive.attributes, primitive.targets), static_cast<uint32_t>(all.size()));
    if (fresh) all.push_back(open(primitive, i));
    return found->second;
  }

  // The source of a vertex.
  const VertexSource &of(uint32_t vertex) const {
    auto after =
        std::upper_bound(all.begin(), all.end(), vertex, [](uint32_t wanted, const VertexSource &source) {
          return wanted < source.first_vertex;
        });
    return *(after - 1);
  }

  Vector<VertexSource> all;
  std::vector<SmoothAttribute> smooth; // in the order of the document

private:
  using Key = std::pair<Attributes, std::vector<Attributes>>;

  Document &document_;
  Accessors &accessors_;
  const tinygltf::Mesh &source_;
  size_t index_;
  std::string pointer_;
  std::map<Key, uint32_t> known_;

  static void put_at(std::vector<const Elements *> &list, size_t number, const Elements *elements) {
    if (list.size() <= number) list.resize(number + 1);
    list[number] = elements;
  }

  static bool is_custom(const std::string &name) {
    return name[0] == '_' && std::none_of(name.begin(), name.end(), [](char c) {
             return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
           });
  }

  static void check_joints(const Attributes &attributes, const VertexSource &source, size_t set,
                           const std::string &pointer) {
    if (!source.joints[set] != !source.weights[set])
      refuse(TW_INVALID, pointer, "JOINTS_", set, " and WEIGHTS_", set, " come together");
    if (!source.joints[set]) return;
    int type = source.joints[set]->component_type();
    if ((type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) ||
        source.joints[set]->normalized())
      refuse(TW_INVALID, text("/accessors/", attributes.at(text("JOINTS_", set)), "/componentType"),
             "joints are unsigned bytes or shorts");
  }

  // Opens an attribute, which must have as many elements as `position`; nullptr without one.
  const Elements *attribute(const Attributes &attributes, const std::string &name, const std::string &pointer,
                            const Elements *position) {
    auto found = attributes.find(name);
    if (found == attributes.end()) return nullptr;
    std::string place = pointer + "/" + pointer_part(name);
    const Elements &elements = accessors_.open_any(found->second, place);
    if (position && elements.count() != position->count())
      refuse(TW_INVALID, place, "the attribute has ", elements.count(), " elements, and POSITION ",
             position->count());
    return &elements;
  }

  const Elements *vector_attribute(const Attributes &attributes, const std::string &name, uint32_t least,
                                   uint32_t most, const std::string &pointer, const Elements *position) {
    const Elements *elements = attribute(attributes, name, pointer, position);
    if (elements && (elements->width() < least || elements->width() > most))
      refuse(TW_INVALID, text("/accessors/", attributes.at(name), "/type"), name, " must have ", least,
             " components");
    return elements;
  }

  VertexSource open(const tinygltf::Primitive &primitive, size_t i) {
    const Attributes &attributes = primitive.attributes;
    std::string primitive_pointer = text(pointer_, i), pointer = primitive_pointer + "/attributes";
    VertexSource source;
    source.position = vector_attribute(attributes, "POSITION", 3, 3, pointer, nullptr);
    if (!source.position) refuse(TW_INVALID, pointer, "a primitive needs the attribute POSITION");
    for (size_t set = 0; set < source.uvs.size(); set++)
      source.uvs[set] = vector_attribute(attributes, text("TEXCOORD_", set), 2, 2, pointer, source.position);
    open_smooth(attributes, i, pointer, source);
    for (size_t set = 0; set < source.joints.size(); set++) {
      source.joints[set] = vector_attribute(attributes, text("JOINTS_", set), 4, 4, pointer, source.position);
      source.weights[set] =
          vector_attribute(attributes, text("WEIGHTS_", set), 4, 4, pointer, source.position);
      check_joints(attributes, source, set, pointer);
      if (set > 0 && source.joints[set] && !source.joints[set - 1])
        refuse(TW_INVALID, pointer, "JOINTS_", set, " needs JOINTS_", set - 1);
    }
    source.normal = vector_attribute(attributes, "NORMAL", 3, 3, pointer, source.position);
    source.tangent = vector_attribute(attributes, "TANGENT", 4, 4, pointer, source.position);
    for (size_t target = 0; target < primitive.targets.size(); target++) {
      const Attributes &displaced = primitive.targets[target];
      std::string place = text(primitive_pointer, "/targets/", target);
      source.morphs.push_back(vector_attribute(displaced, "POSITION", 3, 3, place, source.position));
      source.morph_normals.push_back(vector_attribute(displaced, "NORMAL", 3, 3, place, source.position));
      if (source.normal || !source.morph_normals.back()) continue;
      document_.note("NORMAL of morph targets is left out: there is nothing to displace");
      source.morph_normals.back() = nullptr;
    }
    note_unread(primitive);
    return source;
  }

  // Opens colours and custom attributes, in the order of the document's text: tinygltf does not keep it.
  void open_smooth(const Attributes &attributes, size_t i, const std::string &pointer, VertexSource &source) {
    const char *text = document_.mesh_texts[index_].primitives[i].attributes;
    if (!text || *text != '{') return; // "attributes" is written with escapes
    for (Items item(text); item.more(); item.next()) {
      std::string name = unescape(item.key());
      if (name.size() > TW_NAME_MAX)
        refuse(TW_LIMIT, pointer, "a name has at most ", int{TW_NAME_MAX}, " bytes");
      const Elements *elements = nullptr;
      if (name == "COLOR_0")
        elements = vector_attribute(attributes, name, 3, 4, pointer, source.position);
      else if (is_custom(name))
        elements = attribute(attributes, name, pointer, source.position);
      if (!elements) continue;
      if (accessors_.type_name(attributes.at(name))[0] == 'M')
        document_.note(name + " is left out");
      else if (std::optional<size_t> number = smooth_number(name, *elements); !number)
        document_.note(name + too_many_attributes());
      else
        put_at(source.attributes, *number, elements);
    }
  }

  // Whether the numbers of an attribute name things, whatever they are written as: EXT_mesh_features, and
  // what came before it.
  static bool is_label(const std::string &name) {
    return name.rfind("_FEATURE_ID", 0) == 0 || name == "_BATCHID" || name == "_BATCH_ID";
  }

  // The kind of an attribute's numbers. Integers that stand for fractions are real.
  static tw_numbers numbers_of(const std::string &name, const Elements &elements) {
    if (!is_custom(name) || elements.normalized()) return TW_NUMBERS_REAL;
    switch (elements.component_type()) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: return TW_NUMBERS_INT8;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return TW_NUMBERS_UINT8;
    case TINYGLTF_COMPONENT_TYPE_SHORT: return TW_NUMBERS_INT16;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return TW_NUMBERS_UINT16;
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return is_label(name) ? TW_NUMBERS_WHOLE : TW_NUMBERS_REAL;
    default: return TW_NUMBERS_WHOLE;
    }
  }

  // The kind of an attribute that primitives write as two kinds.
  static tw_numbers both(tw_numbers a, tw_numbers b) {
    if (a == b) return a;
    return a == TW_NUMBERS_REAL || b == TW_NUMBERS_REAL ? TW_NUMBERS_REAL : TW_NUMBERS_WHOLE;
  }

  // The index in `smooth` of an attribute, which is added if there is room; for a colour there always is.
  std::optional<size_t> smooth_number(const std::string &name, const Elements &elements) {
    size_t number = 0, others = 0;
    while (number < smooth.size() && smooth[number].name != name) others += !smooth[number++].is_color();
    if (number == smooth.size() && others == TW_ATTRIBUTES_MAX - 1 && is_custom(name)) return {};
    if (number == smooth.size()) smooth.push_back({name, 0, numbers_of(name, elements)});
    SmoothAttribute &found = smooth[number];
    found.width = found.is_color() ? 4 : std::max(found.width, elements.width());
    found.numbers = both(found.numbers, numbers_of(name, elements));
    return number;
  }

  // Whether a name is PREFIX0, PREFIX1 and so on, below a count of at most ten.
  static bool is_numbered(std::string_view name, std::string_view prefix, size_t count) {
    return name.size() == prefix.size() + 1 && name.substr(0, prefix.size()) == prefix &&
           name.back() >= '0' && static_cast<size_t>(name.back() - '0') < count;
  }
  static_assert(TW_UV_SETS_MAX <= 10 && joint_sets <= 10);

  static bool is_read(const std::string &name) {
    return has_word("POSITION NORMAL TANGENT COLOR_0", name) ||
           is_numbered(name, "TEXCOORD_", TW_UV_SETS_MAX) || is_numbered(name, "JOINTS_", joint_sets) ||
           is_numbered(name, "WEIGHTS_", joint_sets);
  }

  void note_unread(const tinygltf::Primitive &primitive) {
    for (const auto &[name, accessor] : primitive.attributes)
      if (!is_read(name) && !is_custom(name)) document_.note(name + " is left out");
    for (const Attributes &target : primitive.targets)
      for (const auto &[name, accessor] : target)
        if (name != "POSITION" && name != "NORMAL") document_.note(name + " of morph targets is left out");
  }
};

} // namespace gltf

#endif
