// Keeps an object of a document as text without blanks: extras, extensions and unknown members.
#ifndef TWEEND_GLTF_KEPT_OBJECTS_HPP
#define TWEEND_GLTF_KEPT_OBJECTS_HPP

#include <algorithm>
#include <cstring>
#include <iterator>

#include "gltf/kept_elements.hpp"
#include "gltf/named_parts.hpp"

namespace gltf {

// Extensions that name accessors or buffer views by members whose names do not show it, or whose data is
// decoded.
constexpr char buffer_extensions[] = "KHR_draco_mesh_compression EXT_structural_metadata EXT_mesh_manifold "
                                     "EXT_mesh_primitive_edge_visibility CESIUM_primitive_outline";

inline bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

// Whether a member is named like an index of an accessor or buffer view, which answers number anew.
inline bool is_buffer_index(std::string_view key, const char *value) {
  if (*value == '{' || *value == '"') return false;
  return has_word("accessor accessors bufferView bufferViews", key) || ends_with(key, "Accessor") ||
         ends_with(key, "BufferView");
}

// Whether the data of an extension names accessors or buffer views. Extensions inside it are checked on their
// own.
inline bool names_buffers(const char *value) {
  if (*value != '{' && *value != '[') return false;
  for (Items i(value); i.more(); i.next())
    if (is_buffer_index(i.key(), i.value()) ||
        (i.key() != "extras" && i.key() != "extensions" && names_buffers(i.value())))
      return true;
  return false;
}

// Extensions of meshes and primitives whose numbers are known to be no accessors.
constexpr char plain_extensions[] = "KHR_materials_variants KHR_gaussian_splatting KHR_xmp_json_ld";

// Extensions whose objects name, by a member, an element of an array that the root's extension of that name
// has.
struct Pool {
  const char *extension, *member, *array, *one, *many; // what is told where there is no such element
};
constexpr Pool pools[] = {
    {"KHR_lights_punctual", "light", "lights", "light of a node is left out: the document has none such",
     "lights of nodes are left out: the document has none such"}, // first, for may_lead
    {"EXT_lights_ies", "light", "lights", "light of a node is left out: the document has none such",
     "lights of nodes are left out: the document has none such"},
    {"EXT_lights_image_based", "light", "lights", "light of a scene is left out: the document has none such",
     "lights of scenes are left out: the document has none such"},
    {"KHR_xmp_json_ld", "packet", "packets", "packet of metadata is left out: the document has none such",
     "packets of metadata are left out: the document has none such"}};

// Whether a value has numbers that may be indices below `count`: those of an unknown extension of a mesh or a
// primitive are most likely accessors, whatever their names.
inline bool has_indices(const char *value, uint64_t count) {
  if (*value != '{' && *value != '[') return whole_number(value).value_or(count) < count;
  for (Items i(value); i.more(); i.next())
    if (i.key() != "extras" && has_indices(i.value(), count)) return true;
  return false;
}

// An extension that is left out.
struct DroppedExtension {
  std::string name, place;
  size_t count;
};

// What of an object stays as it is, and what of its extensions is written anew or left out. place_ says which
// object it is.
class ObjectPreserver : protected Text {
protected:
  ObjectPreserver(Document &document, Accessors &accessors)
      : Text(document.budget), document_(document), elements_(document, accessors), named_(document) {}

  Document &document_;
  ElementPreserver elements_;
  NamedParts named_;
  std::string place_; // pointer to the object that text_ is made of
  std::vector<DroppedExtension> dropped_;
  std::string_view left_out_; // member of extras that is left out, because it is read and written anew
  uint32_t materials_ = 0, cameras_ = 0, variants_ = 0; // how many there are
  uint32_t pool_counts_[std::size(pools)] = {};         // likewise

  // ---- text

  // Puts a value. is_plain: it is the application's own; otherwise "extensions" in it are those of glTF.
  void put_value(const char *value, bool is_plain = false) {
    bool is_object = *value == '{';
    if (!is_object && *value != '[') return put(value_text(value));
    put(is_object ? "{" : "[");
    for (Items i(value); i.more(); i.next()) {
      if (is_object && !is_plain) {
        put_member(i);
        continue;
      }
      if (is_object)
        put_key(i.key());
      else
        put_comma();
      put_value(i.value(), is_plain);
    }
    put(is_object ? "}" : "]");
  }

  void put_member(const Items &member) {
    if (member.key() == "extensions" && *member.value() == '{') return put_extensions(member.value());
    if (member.key() == "extras") return put_extras(member.value());
    put_key(member.key());
    put_value(member.value());
  }

  // Puts a member with an object, without the items that are skipped; nothing if no item is left.
  template <typename Skip, typename Put>
  void put_some(std::string_view key, const char *object, Skip is_skipped, Put put_one) {
    bool any = false;
    for (Items i(object); i.more(); i.next()) {
      if (is_skipped(i)) continue;
      if (!any) {
        put_key(key);
        put("{");
      }
      any = true;
      put_key(i.key());
      put_one(i);
    }
    if (any) put("}");
  }

  void put_extras(const char *extras) {
    if (left_out_.empty() || *extras != '{' || !tw_json_member(extras, left_out_.data())) {
      put_key("extras");
      return put_value(extras, true);
    }
    put_some(
        "extras", extras, [&](const Items &item) { return item.key() == left_out_; },
        [&](const Items &item) { put_value(item.value(), true); });
  }

  void put_extensions(const char *extensions) {
    put_some(
        "extensions", extensions, [&](const Items &item) { return is_left_out(item); },
        [&](const Items &item) {
          if (item.key() == "EXT_mesh_gpu_instancing")
            put_instances(item.value());
          else if (is_of_primitive("KHR_materials_variants", item))
            put_variants(item.value());
          else if (uint64_t count = details_of(item))
            put_details(item.value(), count);
          else
            put_value(item.value());
        });
  }

  // Puts an object one member of which, where it is an array or an object as `opening` says, is written anew.
  template <typename Put>
  void put_with(const char *object, std::string_view key, char opening, Put put_anew) {
    put("{");
    for (Items i(object); i.more(); i.next()) {
      if (i.key() != key || *i.value() != opening) {
        put_member(i);
        continue;
      }
      put_key(i.key());
      put_anew(i.value());
    }
    put("}");
  }

  // EXT_mesh_gpu_instancing: its attributes are accessors, which get new numbers.
  void put_instances(const char *instances) {
    if (*instances != '{') return put_value(instances, true);
    put_with(instances, "attributes", '{', [&](const char *attributes) {
      put("{");
      named_.mark_accessors(attributes);
      for (Items attribute(attributes); attribute.more(); attribute.next()) {
        put_key(attribute.key());
        put(text(elements_.keep(index_of(attribute.value()), PLAIN,
                                place_ + "/extensions/EXT_mesh_gpu_instancing")));
      }
      put("}");
    });
  }

  // Whether a value is the index of one of `count` elements.
  static bool is_below(const char *value, uint64_t count) {
    return whole_number(value).value_or(count) < count;
  }

  bool is_of_primitive(std::string_view name, const Items &extension) const {
    return extension.key() == name && *extension.value() == '{' && place_.compare(0, 8, "/meshes/") == 0;
  }

  // KHR_materials_variants: materials and variants that the document has not are left out.
  void put_variants(const char *extension) {
    put_with(extension, "mappings", '[', [&](const char *mappings) {
      put("[");
      each(mappings, [&](size_t, const char *mapping) { put_mapping(mapping); });
      put("]");
    });
  }

  void put_mapping(const char *mapping) {
    uint32_t kept = count_variants(mapping);
    if (kept == 0) return;
    put_comma();
    put_with(mapping, "variants", '[', [&](const char *variants) { put_indices(variants, variants_); });
  }

  // Puts an array of indices of `count` elements without those that are not there.
  void put_indices(const char *indices, uint64_t count) {
    put("[");
    each(indices, [&](size_t, const char *index) {
      if (!is_below(index, count)) return;
      put_comma();
      put(value_text(index));
    });
    put("]");
  }

  static uint32_t count_below(const char *indices, uint64_t count) {
    uint32_t below = 0;
    each(indices, [&](size_t, const char *index) { below += is_below(index, count); });
    return below;
  }

  // How many variants a mapping has that are there, as its material is.
  uint32_t count_variants(const char *mapping) const {
    if (*mapping != '{' || !is_below(tw_json_member(mapping, "material"), materials_)) return 0;
    return count_below(tw_json_member(mapping, "variants"), variants_);
  }

  // How many nodes or materials there are, whose MSFT_lod names others of their kind as "ids", which are
  // shown from afar; 0 where the extension is another.
  uint64_t details_of(const Items &extension) const {
    if (extension.key() != "MSFT_lod" || *extension.value() != '{') return 0;
    if (!count_of(tw_json_member(extension.value(), "ids"))) return 0;
    return place_.compare(0, 7, "/nodes/") == 0        ? document_.source.nodes.size()
           : place_.compare(0, 11, "/materials/") == 0 ? materials_
                                                       : 0;
  }

  // MSFT_lod: what the document has not is left out.
  void put_details(const char *extension, uint64_t count) {
    put_with(extension, "ids", '[', [&](const char *ids) { put_indices(ids, count); });
  }

  void tell_unfit(const char *extension) {
    document_.outline.misfit(unfit_extension, [&] { return place_ + extension; });
  }

  // Whether an extension names elements of which the document has none.
  bool names_nothing(const Items &extension) {
    for (size_t i = 0; i < std::size(pools); i++) {
      if (extension.key() != pools[i].extension || place_.empty()) continue;
      const char *index =
          *extension.value() == '{' ? tw_json_member(extension.value(), pools[i].member) : nullptr;
      bool is_there = is_below(index, pool_counts_[i]);
      document_.outline.lose(pools[i].one, pools[i].many, !is_there);
      return !is_there;
    }
    if (uint64_t count = details_of(extension)) {
      const char *ids = tw_json_member(extension.value(), "ids");
      uint32_t there = count_below(ids, count);
      document_.outline.lose("level of detail is left out: the document has no such node or material",
                             "levels of detail are left out: the document has no such nodes or materials",
                             count_of(ids) - there);
      return there == 0;
    }
    if (!is_of_primitive("KHR_materials_variants", extension)) return false;
    const char *mappings = tw_json_member(extension.value(), "mappings");
    if (count_of(mappings) == 0) {
      tell_unfit("/extensions/KHR_materials_variants");
      return false;
    }
    uint64_t kept = 0, lost = 0;
    each(mappings, [&](size_t, const char *mapping) {
      uint32_t own = count_variants(mapping);
      kept += own;
      lost +=
          std::max<uint64_t>(1, *mapping == '{' ? count_of(tw_json_member(mapping, "variants")) : 0) - own;
    });
    document_.outline.lose(
        "variant of a primitive is left out: the document has no such variant, or no such material",
        "variants of primitives are left out: the document has no such variants, or no such materials", lost);
    return kept == 0;
  }

  // Whether an extension was left out of the root, where others of its name have what they refer to.
  bool lacks_root(std::string_view name) const {
    return std::any_of(dropped_.begin(), dropped_.end(), [&](const DroppedExtension &dropped) {
      return dropped.name == name && dropped.place.empty();
    });
  }

  bool is_left_out(const Items &extension) {
    if (extension.key() == "FB_ngon_encoding") return true; // it describes this file's triangles
    if (names_nothing(extension)) return true;
    const uint64_t elements =
        std::max(document_.source.accessors.size(), document_.source.bufferViews.size());
    bool is_of_mesh = place_.compare(0, 8, "/meshes/") == 0;
    if (!lacks_root(extension.key()) && !has_word(buffer_extensions, extension.key()) &&
        !names_buffers(extension.value()) &&
        !(is_of_mesh && !has_word(plain_extensions, extension.key()) &&
          has_indices(extension.value(), elements)))
      return false;
    named_.mark_all(extension.value());
    std::string name(extension.key());
    for (DroppedExtension &dropped : dropped_)
      if (dropped.name == name) {
        dropped.count++;
        return true;
      }
    if (dropped_.size() <= TW_WARNINGS_MAX) dropped_.push_back({name, place_, 1}); // one more: it says so
    return true;
  }

  // ---- objects

  [[noreturn]] void refuse_element() const { refuse(TW_INVALID, place_, "this must be an object"); }

  // Puts an object into text_, without the members in `known`, which an answer writes itself.
  void collect(const char *value, std::string_view known) {
    if (*value != '{') refuse_element();
    document_.budget.place = place_;
    text_.clear();
    put("{");
    for (Items i(value); i.more(); i.next()) {
      if (has_word(known, i.key())) continue;
      if (i.key() == "extensions" && *i.value() != '{') continue;
      if (is_escaped(i.key())) {
        std::string meant = unescape(i.key());
        if (has_word(known, meant) || meant == "extensions") continue;
      }
      put_member(i);
    }
    put("}");
  }

  bool is_empty() const { return text_.size() == 2; }

  const char *copy() {
    char *text = allocate<char>(document_, text_.size() + 1);
    std::copy(text_.begin(), text_.end(), text);
    text[text_.size()] = '\0';
    return text;
  }

  // Keeps an object without the members in `known`; nullptr if nothing is left.
  const char *object(const char *value, std::string_view known) {
    collect(value, known);
    return is_empty() ? nullptr : copy();
  }

  static uint32_t count_of(const char *array) {
    return array && *array == '[' ? static_cast<uint32_t>(tw_json_count(array)) : 0;
  }
};

} // namespace gltf

#endif
