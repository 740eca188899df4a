// What a document says beyond what is read of it, and an answer bears again: extras, extensions, members that
// nobody here knows, materials and the like as a whole. It is kept as text without blanks, each object's on
// its own. Extensions whose data lies in buffers are left out: answers have other buffers.
#include "gltf/document.hpp"

#include <algorithm>

namespace gltf {

namespace {

// Extensions that name accessors or buffer views by members that do not show it, or whose data is decoded.
constexpr char buffer_extensions[] = "KHR_draco_mesh_compression EXT_structural_metadata EXT_mesh_manifold "
                                     "EXT_mesh_primitive_edge_visibility CESIUM_primitive_outline";

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

// A member that is called like an index into what an answer has anew.
bool is_buffer_index(std::string_view key, const char *value) {
  if (*value == '{' || *value == '"') return false;
  return has_word("accessor accessors bufferView bufferViews", key) || ends_with(key, "Accessor") ||
         ends_with(key, "BufferView");
}

// Whether the data of an extension names accessors or buffer views. Extensions inside are looked at on their
// own.
bool names_buffers(const char *value) {
  if (*value != '{' && *value != '[') return false;
  for (Items i(value); i.more(); i.next())
    if (is_buffer_index(i.key(), i.value()) ||
        (i.key() != "extras" && i.key() != "extensions" && names_buffers(i.value())))
      return true;
  return false;
}

// Calls element(index, value) for each element of an array; for none of what is no array.
template <typename Element> void each(const char *array, Element element) {
  size_t index = 0;
  if (array && *array == '[')
    for (Items i(array); i.more(); i.next()) element(index++, i.value());
}

class Keeper {
public:
  explicit Keeper(Document &document)
      : document_(document), kept_(document.kept), text_(Counted<char>(document.budget)) {}

  void run(tw_gltf_assets &assets) {
    const char *root = document_.outline.root;
    place_ = "";
    assets.root = object(
        root, "accessors animations asset buffers bufferViews cameras extensionsUsed extensionsRequired "
              "images materials meshes nodes samplers scene scenes skins textures");
    place_ = "/asset";
    if (const char *asset = find_member(root, "asset"))
      assets.asset = object(asset, "version minVersion generator");
    assets.materials = objects("materials");
    assets.textures = objects("textures");
    assets.samplers = objects("samplers");
    assets.cameras = objects("cameras");
    assets.extensions_used = names("extensionsUsed");
    assets.extensions_required = names("extensionsRequired");
    images(assets);
    scenes(assets);
    parts("nodes", kept_.nodes, "name children mesh skin matrix translation rotation scale weights");
    parts("skins", kept_.skins, "name joints skeleton inverseBindMatrices");
    parts("meshes", kept_.meshes, "name primitives weights");
    parts("animations", kept_.animations, "name channels samplers");
    primitives();
    tracks();
    warn();
  }

private:
  // An extension that is left out.
  struct Dropped {
    std::string name, place;
    size_t count;
  };

  Document &document_;
  Kept &kept_;
  Vector<char> text_; // of the object under way
  std::string place_; // of it
  std::vector<Dropped> dropped_;
  size_t unplaced_ = 0; // accessors, buffer views and buffers that say more than is read

  // ---- text

  void put(std::string_view text) { text_.insert(text_.end(), text.begin(), text.end()); }

  void put_key(std::string_view key) {
    if (text_.back() != '{') put(",");
    put("\"");
    put(key);
    put("\":");
  }

  void put_plain(const char *value) {
    bool is_object = *value == '{';
    if (!is_object && *value != '[') return put(value_text(value));
    put(is_object ? "{" : "[");
    for (Items i(value); i.more(); i.next()) {
      if (is_object) put_key(i.key());
      if (!is_object && text_.back() != '[') put(",");
      put_plain(i.value());
    }
    put(is_object ? "}" : "]");
  }

  // A value whose extensions are those of glTF.
  void put_value(const char *value) {
    bool is_object = *value == '{';
    if (!is_object && *value != '[') return put(value_text(value));
    put(is_object ? "{" : "[");
    for (Items i(value); i.more(); i.next()) {
      if (is_object)
        put_member(i);
      else {
        if (text_.back() != '[') put(",");
        put_value(i.value());
      }
    }
    put(is_object ? "}" : "]");
  }

  void put_member(const Items &member) {
    if (member.key() == "extensions" && *member.value() == '{') return put_extensions(member.value());
    put_key(member.key());
    if (member.key() == "extras")
      put_plain(member.value());
    else
      put_value(member.value());
  }

  void put_extensions(const char *extensions) {
    bool any = false;
    for (Items i(extensions); i.more(); i.next()) {
      if (is_left_out(i)) continue;
      if (!any) {
        put_key("extensions");
        put("{");
      }
      any = true;
      put_key(i.key());
      put_value(i.value());
    }
    if (any) put("}");
  }

  bool is_left_out(const Items &extension) {
    if (extension.key() == "FB_ngon_encoding") return true; // of this file's triangles
    if (!has_word(buffer_extensions, extension.key()) && !names_buffers(extension.value())) return false;
    std::string name(extension.key());
    for (Dropped &dropped : dropped_)
      if (dropped.name == name) {
        dropped.count++;
        return true;
      }
    if (dropped_.size() < 64) dropped_.push_back({name, place_, 1}); // as many warnings as there may be
    return true;
  }

  // ---- objects

  [[noreturn]] void refuse_element() const { refuse(TW_INVALID, place_, "this must be an object"); }

  // An object without the members that an answer writes itself, in text_.
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

  // nullptr where nothing is left.
  const char *object(const char *value, std::string_view known) {
    collect(value, known);
    return is_empty() ? nullptr : copy();
  }

  static uint32_t count_of(const char *array) {
    return array && *array == '[' ? static_cast<uint32_t>(tw_json_count(array)) : 0;
  }

  // Whole objects.
  tw_gltf_objects objects(const char *member) {
    const char *array = find_member(document_.outline.root, member);
    tw_gltf_objects out = {count_of(array), nullptr};
    out.items = allocate<const char *>(document_, out.count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/", member, "/", i);
      collect(value, "");
      out.items[i] = copy();
    });
    return out;
  }

  tw_gltf_objects names(const char *member) {
    const char *array = find_member(document_.outline.root, member);
    tw_gltf_objects out = {0, nullptr};
    out.items = allocate<const char *>(document_, count_of(array));
    each(array, [&](size_t, const char *value) {
      if (*value != '"') return;
      std::string_view name = string_of(value);
      text_.assign(name.begin(), name.end());
      out.items[out.count++] = copy();
    });
    return out;
  }

  void parts(const char *member, Vector<const char *> &out, std::string_view known) {
    each(find_member(document_.outline.root, member), [&](size_t i, const char *value) {
      place_ = text("/", member, "/", i);
      out.push_back(object(value, known));
    });
  }

  // ---- images and scenes

  void images(tw_gltf_assets &assets) {
    const char *array = find_member(document_.outline.root, "images");
    const Vector<ImageOutline> &inside = document_.outline.images;
    size_t next = 0;
    assets.image_count = count_of(array);
    assets.images = allocate_zero<tw_gltf_image>(document_, assets.image_count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/images/", i);
      bool is_taken = next < inside.size() && inside[next].index == i;
      next += is_taken;
      collect(value, is_taken ? "bufferView uri mimeType" : "");
      assets.images[i].kept = copy();
    });
  }

  void scenes(tw_gltf_assets &assets) {
    const char *array = find_member(document_.outline.root, "scenes");
    assets.scene_count = count_of(array);
    assets.scenes = allocate_zero<tw_gltf_scene>(document_, assets.scene_count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/scenes/", i);
      assets.scenes[i].kept = object(value, "nodes");
    });
  }

  // ---- parts of parts

  void primitives() {
    each(find_member(document_.outline.root, "meshes"), [&](size_t, const char *mesh) {
      kept_.first_primitive.push_back(kept_.marked.size());
      each(find_member(mesh, "primitives"), [&](size_t, const char *primitive) {
        const char *extensions = find_member(primitive, "extensions");
        kept_.marked.push_back(extensions && find_member(extensions, "FB_ngon_encoding"));
      });
    });
  }

  void tracks() {
    each(find_member(document_.outline.root, "animations"), [&](size_t index, const char *animation) {
      const char *samplers = find_member(animation, "samplers");
      Vector<const char *> sampler_texts{Counted<const char *>(document_.budget)};
      each(samplers, [&](size_t i, const char *sampler) {
        place_ = text("/animations/", index, "/samplers/", i);
        sampler_texts.push_back(object(sampler, "input output interpolation"));
      });
      kept_.first_channel.push_back(kept_.channels.size());
      each(find_member(animation, "channels"), [&](size_t i, const char *channel) {
        place_ = text("/animations/", index, "/channels/", i);
        kept_.channels.push_back(track(channel, sampler_texts));
      });
    });
  }

  // What channel, target and sampler say as one object; a sampler that several channels name is with each.
  const char *track(const char *channel, const Vector<const char *> &samplers) {
    const char *own = object(channel, "sampler target"), *target = find_member(channel, "target");
    const char *of_target = target ? object(target, "node path") : nullptr;
    const char *number = find_member(channel, "sampler");
    double sampler = -1;
    if (number && tw_json_is_number(number)) tw_json_number(number, &sampler);
    bool has_sampler = sampler >= 0 && sampler < static_cast<double>(samplers.size());
    const char *of_sampler = has_sampler ? samplers[static_cast<size_t>(sampler)] : nullptr;
    text_.clear();
    put("{");
    put_part("channel", own);
    put_part("target", of_target);
    put_part("sampler", of_sampler);
    put("}");
    return is_empty() ? nullptr : copy();
  }

  void put_part(const char *name, const char *part) {
    if (!part) return;
    put_key(name);
    put(part);
  }

  // ---- what is not kept

  void count_unplaced(const char *member) {
    each(find_member(document_.outline.root, member), [&](size_t, const char *value) {
      const char *extensions = find_member(value, "extensions");
      bool says_more =
          find_member(value, "extras") || (extensions && *extensions == '{' && tw_json_count(extensions) > 0);
      unplaced_ += says_more && !(extensions && find_member(extensions, "EXT_meshopt_compression"));
    });
  }

  void warn() {
    for (const Dropped &dropped : dropped_)
      tw_model_warn(document_.model, "the extension %s at %s is left out: its data is in buffers%s",
                    dropped.name.c_str(), dropped.place.c_str(),
                    dropped.count > 1 ? text(", as at ", dropped.count - 1, " more places").c_str() : "");
    count_unplaced("accessors");
    count_unplaced("bufferViews");
    count_unplaced("buffers");
    if (unplaced_ > 0)
      tw_model_warn(document_.model,
                    "extras and extensions of %zu accessors, buffer views and buffers are left out",
                    unplaced_);
  }
};

} // namespace

void keep_parts(Document &document) {
  tw_gltf_assets *assets = allocate_zero<tw_gltf_assets>(document, 1);
  Keeper(document).run(*assets);
  document.assets = assets;
  document.model->assets = assets;
}

} // namespace gltf
