// Makes the document that tinygltf parses: a copy of the checked one without buffers, images and all that is
// not read. Sums up the memory that parsing it takes.
#include "gltf/document.hpp"

#include <algorithm>
#include <cmath>

namespace gltf {

namespace {

// Bytes that malloc uses for an allocation.
constexpr uint64_t chunk(uint64_t size) {
  return size == 0 ? 0 : size <= 24 ? 32 : (size + 8 + 15) / 16 * 16;
}

// Bytes of the parser's JSON tree, which is made of std::map, std::vector and std::string.
constexpr uint64_t tree_slot = 16, tree_member = chunk(80), tree_object = chunk(48), tree_array = chunk(24),
                   tree_string = chunk(32);

// The most bytes that a value takes in tinygltf's structs: an entry of a map (attributes), an element of an
// array (numbers), a map in an array (targets).
constexpr uint64_t member_cost = 80, element_cost = 16, object_cost = 96;

template <auto Member> void reserve(tinygltf::Model &model, size_t count) {
  (model.*Member).reserve(count);
}

// Whether tinygltf keeps the room that was reserved in a model. From 2.9 on it does not: it begins with an
// empty model, whose arrays double as they grow.
bool parser_keeps_room() {
  static const bool keeps = [] {
    static const char document[] = "{\"asset\":{\"version\":\"2.0\"}}";
    tinygltf::Model model;
    std::string error, warning;
    model.nodes.reserve(8);
    tinygltf::TinyGLTF().LoadASCIIFromString(&model, &error, &warning, document, sizeof document - 1, "");
    return model.nodes.capacity() >= 8;
  }();
  return keeps;
}

template <typename Predicate> bool are_all(const char *container, char opening, Predicate is_fit) {
  if (*container != opening) return false;
  for (Items i(container); i.more(); i.next())
    if (!is_fit(i.value())) return false;
  return true;
}

bool is_integer(const char *value) {
  double number;
  if (!tw_json_is_number(value)) return false;
  tw_json_number(value, &number);
  return number == std::floor(number);
}

// -1 is none: the parser takes it as if the member were not there. Integers that are out of range are
// refused where they are read, with their place.
bool is_index(const char *value) {
  return is_integer(value) && value_text(value) != "-1";
}

// Whether the value of a member that is read has the type that glTF's schemas give it. The members of
// attributes are checked by the parser, those of targets here: it would pass over them.
bool has_its_type(std::string_view name, const char *value) {
  if (has_word("matrix translation rotation scale weights", name))
    return are_all(value, '[', [](const char *number) { return tw_json_is_number(number); });
  if (has_word("children joints nodes", name)) return are_all(value, '[', is_integer);
  if (name == "targets")
    return are_all(value, '[', [](const char *target) { return are_all(target, '{', is_integer); });
  if (has_word("name version minVersion type interpolation path", name)) return *value == '"';
  if (has_word("attributes sparse extensions", name)) return *value == '{';
  if (name == "normalized") return *value == 't' || *value == 'f';
  return is_index(value);
}

// What is read of an object, or of each object of an array; all else is left out.
struct Schema {
  std::string_view key;      // of the member that holds it
  uint64_t size;             // bytes of tinygltf's struct for an element of the array; 0: no array
  std::string_view members;  // that are copied, a blank between two
  std::vector<Schema> parts; // members of which only a part is copied
  void (*reserve)(tinygltf::Model &model, size_t count) = nullptr; // of the root's arrays
  bool (*is_read)(const char *element) = nullptr;                  // nullptr: all elements are

  const Schema *part(std::string_view name) const {
    auto found =
        std::find_if(parts.begin(), parts.end(), [&](const Schema &part) { return part.key == name; });
    return found == parts.end() ? nullptr : &*found;
  }
  // An escaped key may be any member: kept for tinygltf.
  bool has(std::string_view name) const { return is_escaped(name) || has_word(members, name) || part(name); }

  // Whether a member's value can be read: part() is an array or an object, and all else has its type. What
  // is not read has any type, but for extensions, which are kept only as an object.
  bool can_read(std::string_view name, const char *value) const {
    if (is_escaped(name)) return true;
    if (const Schema *inner = part(name)) return *value == (inner->size ? '[' : '{');
    return (!has_word(members, name) && name != "extensions") || has_its_type(name, value);
  }
};

const Schema &root_schema() {
  using namespace tinygltf;
  static const Schema target = {"target", 0, target_members, {}},
                      primitives = {"primitives", 2 * sizeof(Primitive), primitive_members, {}},
                      channels = {"channels", sizeof(AnimationChannel), channel_members, {target}, nullptr,
                                  is_track},
                      samplers = {"samplers", sizeof(AnimationSampler), sampler_members, {}};
  static const Schema root = {"",
                              0,
                              "scene",
                              {{"asset", 0, "version minVersion", {}},
                               {"nodes", sizeof(Node), node_members, {}, reserve<&Model::nodes>},
                               {"meshes", sizeof(Mesh), mesh_members, {primitives}, reserve<&Model::meshes>},
                               {"accessors",
                                sizeof(Accessor),
                                "bufferView byteOffset normalized componentType count type sparse",
                                {},
                                reserve<&Model::accessors>},
                               {"bufferViews",
                                sizeof(BufferView),
                                "buffer byteOffset byteLength byteStride",
                                {},
                                reserve<&Model::bufferViews>},
                               {"skins", sizeof(Skin), skin_members, {}, reserve<&Model::skins>},
                               {"animations",
                                sizeof(Animation),
                                animation_members,
                                {channels, samplers},
                                reserve<&Model::animations>},
                               {"scenes", sizeof(Scene), scene_members, {}, reserve<&Model::scenes>}}};
  return root;
}

// Copies what is read, and sums up what parsing the copy will take.
class Copier : Text {
public:
  explicit Copier(Document &document)
      : Text(document.budget), budget_(document.budget), out_(document.outline), parsed_(document.source) {}

  void run(const char *root) {
    size_t size = 2 + sizeof assumed_asset;
    for (Items i(root); i.more(); i.next())
      if (root_schema().has(i.key())) size += i.key().size() + 4 + value_text(i.value()).size();
    text_.reserve(size);
    copy(root, &root_schema(), nullptr);
    if (*root == '{' && !tw_json_member(root, "asset")) add_asset();
    out_.json = std::move(text_);
    out_.tree_size = tree_ + growth_ + 6 * longest_;
    out_.model_size = model_;
  }

private:
  static constexpr char assumed_asset[] = "\"asset\":{\"version\":\"2.0\"}";

  Budget &budget_;
  Outline &out_;
  tinygltf::Model &parsed_;
  uint64_t tree_ = 0, model_ = 0;
  uint64_t growth_ = 0;  // the most that an array takes beside itself while it grows
  uint64_t longest_ = 0; // text; the parser holds several copies of it

  // Adds the asset of glTF 2.0 to a document without one.
  void add_asset() {
    text_.pop_back();
    put_comma();
    put(assumed_asset);
    put("}");
    tree_ += tree_object + 2 * tree_member + tree_string;
    out_.lose("asset is missing: the document is read as glTF 2.0",
              "assets are missing: the document is read as glTF 2.0");
  }

  void check(std::string_view array, uint64_t index) const {
    if (tree_ + model_ + growth_ + 6 * longest_ <= budget_.left()) return;
    refuse(TW_LIMIT, text("/", array, "/", index), "the JSON text up to here takes too much memory to parse");
  }

  // Arrays double as they grow.
  void count_array(uint64_t &sum, uint64_t count, uint64_t size) {
    uint64_t capacity = count > 0;
    while (capacity < count) capacity *= 2;
    sum += chunk(capacity * size);
    growth_ = std::max(growth_, chunk(capacity * size / 2));
  }

  // Text of up to 15 bytes lies inside its std::string.
  void count_text(uint64_t size, uint64_t copies) {
    if (size > 15) {
      tree_ += chunk(size + 1);
      model_ += copies * chunk(size + 1);
    }
    longest_ = std::max(longest_, size);
  }

  // An object of the schemas in the document.
  struct Place {
    const Place *above;
    std::string_view key;
    uint64_t index; // in the array that the key names; no_index: the key names the object
  };
  static constexpr uint64_t no_index = UINT64_MAX;

  static std::string pointer(const Place *place) {
    if (!place) return "";
    std::string key = text(pointer(place->above), "/", place->key);
    return place->index == no_index ? key : text(key, "/", place->index);
  }

  // schema: nullptr for what is copied as it is. place: of the value; nullptr for the root.
  void copy(const char *value, const Schema *schema, const Place *place) {
    if (*value == '{') return copy_object(value, schema, place);
    if (*value == '[') return copy_array(value, schema, place);
    put(value_text(value));
    if (*value != '"') return;
    tree_ += tree_string;
    count_text(string_of(value).size(), 2);
  }

  // Names are left out: copy_name_of reads them. They may be most of the text, and the parser cannot be
  // ended.
  void copy_object(const char *value, const Schema *schema, const Place *place) {
    tree_ += tree_object;
    if (!schema) model_ += object_cost;
    put("{");
    for (Items i(value); i.more(); i.next()) {
      if (schema && !schema->can_read(i.key(), i.value())) {
        out_.misfit(not_its_type, [&] { return text(pointer(place), "/", i.key()); });
        continue;
      }
      if (schema && (!schema->has(i.key()) || i.key() == "name")) continue;
      if (!schema) model_ += member_cost;
      tree_ += tree_member;
      count_text(i.key().size(), 1);
      put_key(i.key());
      const Place member = {place, i.key(), no_index};
      copy(i.value(), schema ? schema->part(i.key()) : nullptr, &member);
    }
    put("}");
  }

  void copy_array(const char *value, const Schema *schema, const Place *place) {
    bool is_root_array = schema && schema->reserve;
    uint64_t count = 0;
    Place element = place ? *place : Place{nullptr, "", no_index};
    element.index = no_index;
    put("[");
    for (Items i(value); i.more(); i.next()) {
      element.index++;
      if (schema && schema->is_read && !schema->is_read(i.value())) continue;
      put_comma();
      copy(i.value(), schema, &element);
      if (is_root_array) { // its array is reserved for exactly these
        if (parser_keeps_room()) model_ += schema->size;
        check(schema->key, count);
      }
      count++;
    }
    put("]");
    tree_ += tree_array;
    count_array(tree_, count, tree_slot);
    if (is_root_array && parser_keeps_room())
      schema->reserve(parsed_, static_cast<size_t>(count));
    else
      count_array(model_, count, schema ? schema->size : element_cost);
    if (is_root_array) check(schema->key, count);
  }
};

} // namespace

void copy_for_parser(const char *root, Document &document) {
  Copier(document).run(root);
}

} // namespace gltf
