// Keeps for answers what a document holds beyond what is read: extras, extensions, unknown members, and
// materials and the like as a whole. It is preserved as text without blanks, for each object apart.
// Extensions whose data is in buffers are left out: answers have other buffers.
#include "gltf/kept_objects.hpp"
#include "gltf/pointers.hpp"

namespace gltf {

namespace {

class Preserver : ObjectPreserver {
public:
  Preserver(Document &document, Accessors &accessors)
      : ObjectPreserver(document, accessors), pointers_(document) {}

  void run(tw_gltf_assets &assets) {
    const char *root = document_.outline.root;
    place_ = "";
    const char *extensions = tw_json_member(root, "extensions");
    for (size_t i = 0; i < std::size(pools); i++)
      pool_counts_[i] =
          count_of(tw_json_member(tw_json_member(extensions, pools[i].extension), pools[i].array));
    variants_ = count_of(tw_json_member(tw_json_member(extensions, "KHR_materials_variants"), "variants"));
    assets.root = object(
        root, "accessors animations asset buffers bufferViews cameras extensionsUsed extensionsRequired "
              "images materials meshes nodes samplers scene scenes skins textures");
    place_ = "/asset";
    if (const char *asset = tw_json_member(root, "asset"))
      assets.asset = object(asset, "version minVersion generator");
    materials_ = count_of(tw_json_member(root, "materials"));
    assets.materials = objects("materials");
    assets.textures = objects("textures");
    assets.samplers = objects("samplers");
    assets.cameras = objects("cameras");
    cameras_ = assets.cameras.count;
    assets.extensions_used = names("extensionsUsed");
    assets.extensions_required = names("extensionsRequired");
    images(assets);
    scenes(assets);
    const tinygltf::Model &source = document_.source;
    tw_model &model = *document_.model;
    const std::string known = std::string("camera ") + node_members;
    parts("nodes", source.nodes, model.nodes, model.node_count, [&](const char *node) {
      return std::string_view(known).substr(has_camera(node) ? sizeof "camera" : 0);
    });
    tell_idle_transforms();
    parts("skins", source.skins, model.skins, model.skin_count,
          [](const char *) -> std::string_view { return skin_members; });
    check_parsed(assets.scene_count, source.scenes, "/scenes");
    meshes();
    animations();
    elements_.finish(assets);
    warn();
  }

private:
  size_t unplaced_ = 0; // accessors, buffer views and buffers with extras or extensions, which are left out
  Pointers pointers_;

  // ---- objects

  // Keeps the objects of one of the root's arrays as a whole.
  tw_gltf_objects objects(const char *member) {
    const char *array = tw_json_member(document_.outline.root, member);
    tw_gltf_objects out = {count_of(array), nullptr};
    out.items = allocate<const char *>(document_, out.count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/", member, "/", i);
      check_extensions(value);
      collect(value, "");
      out.items[i] = copy();
    });
    return out;
  }

  // Tells of extensions that collect leaves out, of objects that the parser does not read.
  void check_extensions(const char *value) {
    const char *extensions = *value == '{' ? tw_json_member(value, "extensions") : nullptr;
    if (extensions && *extensions != '{')
      document_.outline.misfit(not_its_type, [&] { return place_ + "/extensions"; });
  }

  tw_gltf_objects names(const char *member) {
    const char *array = tw_json_member(document_.outline.root, member);
    tw_gltf_objects out = {0, nullptr};
    out.items = allocate<const char *>(document_, count_of(array));
    auto misfit = [&] { document_.outline.misfit(not_its_type, [&] { return text("/", member); }); };
    if (array && *array != '[') misfit();
    each(array, [&](size_t, const char *value) {
      if (*value != '"') return misfit();
      std::string_view name = string_of(value);
      text_.assign(name.begin(), name.end());
      out.items[out.count++] = copy();
    });
    return out;
  }

  // Allocates the model's parts, as many as were parsed; returns the document's array.
  template <typename Parsed, typename Part>
  const char *room(const char *member, const Parsed &parsed, Part *&out, uint32_t &count) {
    const char *array = tw_json_member(document_.outline.root, member);
    check_parsed(count_of(array), parsed, text("/", member));
    document_.budget.place = text("/", member);
    count = count_of(array);
    out = allocate_zero<Part>(document_, count);
    return array;
  }

  // known: the members of an object that are not kept.
  template <typename Parsed, typename Part, typename Known>
  void parts(const char *member, const Parsed &parsed, Part *&out, uint32_t &count, Known known) {
    each(room(member, parsed, out, count), [&](size_t i, const char *value) {
      place_ = text("/", member, "/", i);
      out[i].preserved = object(value, known(value));
      out[i].name = copy_name_of(document_, value);
    });
  }

  // Whether a node names no camera, or one that is there; others are left out.
  bool has_camera(const char *node) {
    const char *camera = *node == '{' ? tw_json_member(node, "camera") : nullptr;
    bool is_there = !camera || is_below(camera, cameras_);
    document_.outline.lose("camera of a node is left out: the document has none such",
                           "cameras of nodes are left out: the document has none such", !is_there);
    return is_there;
  }

  // Tells of members that the parser passes over beside a matrix.
  void tell_idle_transforms() {
    each(tw_json_member(document_.outline.root, "nodes"), [&](size_t, const char *node) {
      bool is_idle = tw_json_member(node, "matrix") &&
                     (tw_json_member(node, "translation") || tw_json_member(node, "rotation") ||
                      tw_json_member(node, "scale"));
      document_.outline.lose(
          "node has a matrix beside a translation, rotation or scale: the matrix counts",
          "nodes have matrices beside translations, rotations or scales: the matrices count", is_idle);
    });
  }

  // ---- images and scenes

  void images(tw_gltf_assets &assets) {
    const char *array = tw_json_member(document_.outline.root, "images");
    const Vector<ImageOutline> &inside = document_.outline.images;
    size_t next = 0;
    assets.image_count = count_of(array);
    assets.images = allocate_zero<tw_gltf_image>(document_, assets.image_count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/images/", i);
      check_extensions(value);
      bool is_taken = next < inside.size() && inside[next].index == i;
      next += is_taken;
      collect(value, is_taken ? "bufferView uri mimeType" : "");
      assets.images[i].preserved = copy();
    });
  }

  void scenes(tw_gltf_assets &assets) {
    const char *array = tw_json_member(document_.outline.root, "scenes");
    assets.scene_count = count_of(array);
    assets.scenes = allocate_zero<tw_gltf_scene>(document_, assets.scene_count);
    each(array, [&](size_t i, const char *value) {
      place_ = text("/scenes/", i);
      assets.scenes[i].preserved = object(value, scene_members);
    });
  }

  // Refuses a document of which tinygltf skipped elements that it could not read: indices of the document
  // would not be those of its arrays.
  template <typename Parsed>
  static void check_parsed(size_t count, const Parsed &parsed, const std::string &pointer) {
    if (parsed.size() != count) refuse(TW_INVALID, pointer, "there is an element that is not valid glTF");
  }

  // ---- primitives

  void meshes() {
    tw_model &model = *document_.model;
    const std::vector<tinygltf::Mesh> &parsed = document_.source.meshes;
    each(room("meshes", parsed, model.meshes, model.mesh_count), [&](size_t index, const char *mesh) {
      Vector<char> loose{document_.budget};
      place_ = text("/meshes/", index);
      check_parsed(count_of(tw_json_member(mesh, "primitives")), parsed[index].primitives,
                   place_ + "/primitives");
      tw_mesh_init(&model.meshes[index]);
      left_out_ = "tweend";
      model.meshes[index].preserved = object(mesh, mesh_members);
      model.meshes[index].name = copy_name_of(document_, mesh);
      const char *tags = mesh_tags(mesh);
      MeshText texts = {tags, Vector<PrimitiveText>(document_.budget)};
      if (tags) named_.mark_all(tags);
      left_out_ = tags && tw_json_member(tags, "groups") ? "groups" : ""; // which the tags hold, too
      each(tw_json_member(mesh, "primitives"), [&](size_t i, const char *primitive) {
        named_.mark_primitive(primitive);
        place_ = text("/meshes/", index, "/primitives/", i);
        const char *extensions = tw_json_member(primitive, "extensions");
        const char *preserved = object(primitive, primitive_members);
        texts.primitives.push_back(
            {preserved, tw_json_member(primitive, "attributes"), bears_ngons(extensions)});
        const tinygltf::Primitive &own = parsed[index].primitives[i];
        if (own.attributes.count("POSITION") == 0 || own.mode < TINYGLTF_MODE_POINTS ||
            own.mode >= TINYGLTF_MODE_TRIANGLES)
          return;
        append(loose, loose_primitive(own, preserved));
        model.meshes[index].loose_has_joints |= own.attributes.count("JOINTS_0") > 0;
        model.meshes[index].loose_has_targets |= !own.targets.empty();
      });
      left_out_ = "";
      document_.mesh_texts.push_back(std::move(texts));
      model.meshes[index].loose = close(loose);
    });
  }

  bool bears_ngons(const char *extensions) {
    const char *extension = tw_json_member(extensions, "FB_ngon_encoding");
    if (!extension || *extension == '{') return extension;
    tell_unfit("/extensions/FB_ngon_encoding");
    return false;
  }

  const char *mesh_tags(const char *mesh) {
    const char *extras = tw_json_member(mesh, "extras"),
               *tags = extras && *extras == '{' ? tw_json_member(extras, "tweend") : nullptr;
    if (!tags || *tags == '{') return tags;
    document_.outline.misfit("left out, as this is no object", [&] { return place_ + "/extras/tweend"; });
    return nullptr;
  }

  // Appends an element to the text of an array.
  void append(Vector<char> &array, const Vector<char> &element) {
    array.push_back(array.empty() ? '[' : ',');
    array.insert(array.end(), element.begin(), element.end());
  }

  // Ends the text of an array and keeps it; nullptr for an array without elements.
  const char *close(const Vector<char> &array) {
    if (array.empty()) return nullptr;
    text_ = array;
    put("]");
    return copy();
  }

  // Puts a primitive of points or lines into text_. preserved: its members that are not read, or nullptr.
  const Vector<char> &loose_primitive(const tinygltf::Primitive &primitive, const char *preserved) {
    check_loose(primitive);
    text_.clear();
    put("{\"attributes\":");
    put_attributes(primitive.attributes, "/attributes");
    if (primitive.indices != -1)
      put(text(",\"indices\":", elements_.keep(primitive.indices, INDICES, place_ + "/indices")));
    if (primitive.material != -1) put(text(",\"material\":", primitive.material));
    put(text(",\"mode\":", primitive.mode));
    for (size_t i = 0; i < primitive.targets.size(); i++) {
      put(i ? "," : ",\"targets\":[");
      put_attributes(primitive.targets[i], text("/targets/", i));
    }
    if (!primitive.targets.empty()) put("]");
    if (preserved) {
      put(",");
      put(preserved + 1);
    } else {
      put("}");
    }
    return text_;
  }

  void put_attributes(const std::map<std::string, int> &attributes, const std::string &where) {
    bool any = false;
    put("{");
    for (const auto &[name, accessor] : attributes) {
      bool is_plain = std::all_of(name.begin(), name.end(),
                                  [](char c) { return c > ' ' && c < 0x7F && c != '"' && c != '\\'; });
      if (!is_plain) {
        document_.note(name + " of points and lines is left out");
        continue;
      }
      bool as_it_is = has_word("COLOR JOINTS WEIGHTS", name.substr(0, name.find('_'))) || name[0] == '_';
      put(text(any ? "," : "", "\"", name, "\":",
               elements_.keep(accessor, as_it_is ? VERTICES : VERTICES_AS_FLOATS,
                              text(place_, where, "/", pointer_part(name)))));
      any = true;
    }
    put("}");
  }

  void check_loose(const tinygltf::Primitive &primitive) {
    auto found = primitive.attributes.find("POSITION");
    if (found == primitive.attributes.end())
      refuse(TW_INVALID, place_ + "/attributes", "a primitive needs the attribute POSITION");
    if (primitive.material < -1 || primitive.material >= static_cast<int64_t>(materials_))
      refuse(TW_INVALID, place_ + "/material", "there is no material ", primitive.material);
    const Elements &position = elements_.open(found->second, place_ + "/attributes/POSITION");
    document_.shown.add_all(position);
    if (position.width() != 3)
      refuse(TW_INVALID, text("/accessors/", found->second, "/type"), "POSITION must have 3 components");
    check_counts(primitive.attributes, position.count(), "/attributes/");
    for (size_t i = 0; i < primitive.targets.size(); i++)
      check_counts(primitive.targets[i], position.count(), text("/targets/", i, "/"));
    if (primitive.indices == -1) return;
    const Elements &indices = elements_.open(primitive.indices, place_ + "/indices");
    document_.spend_values(indices.count(), place_ + "/indices", "the indices of points and lines");
    for (uint32_t i = 0; i < indices.count(); i++)
      if (indices.width() != 1 || indices.read_index(i) >= position.count())
        refuse(TW_INVALID, text("/accessors/", primitive.indices), "index ", i, " is out of range");
  }

  void check_counts(const std::map<std::string, int> &attributes, uint32_t count, const std::string &where) {
    for (const auto &[name, accessor] : attributes) {
      std::string pointer = place_ + where + pointer_part(name);
      if (elements_.open(accessor, pointer).count() != count)
        refuse(TW_INVALID, pointer, "the attribute does not have as many elements as POSITION");
    }
  }

  // ---- channels

  void animations() {
    tw_model &model = *document_.model;
    const std::vector<tinygltf::Animation> &all = document_.source.animations;
    pointers_.know(materials_, cameras_, pool_counts_[0]);
    each(room("animations", all, model.clips, model.clip_count), [&](size_t index, const char *animation) {
      place_ = text("/animations/", index);
      model.clips[index].preserved = object(animation, animation_members);
      model.clips[index].name = copy_name_of(document_, animation);
      const char *samplers = tw_json_member(animation, "samplers");
      const tinygltf::Animation &parsed = all[index];
      check_parsed(count_of(samplers), parsed.samplers, text("/animations/", index, "/samplers"));
      Vector<const char *> sampler_texts{document_.budget};
      Vector<char> loose{document_.budget};
      each(samplers, [&](size_t i, const char *sampler) {
        place_ = text("/animations/", index, "/samplers/", i);
        named_.mark_sampler(sampler);
        sampler_texts.push_back(object(sampler, sampler_members));
      });
      Vector<const char *> tracks{document_.budget};
      Vector<MeshChannel> of_meshes{document_.budget};
      Vector<WeightChannel> of_weights{document_.budget};
      std::set<int> named; // samplers
      std::vector<TrackPlace> places;
      pointers_.begin(parsed, static_cast<uint32_t>(index));
      each(tw_json_member(animation, "channels"), [&](size_t i, const char *channel) {
        place_ = text("/animations/", index, "/channels/", i);
        named.insert(index_of(tw_json_member(channel, "sampler")));
        std::optional<PointedChannel> points = pointers_.to_node(channel, place_);
        std::optional<uint32_t> mesh = pointers_.to_mesh(channel);
        std::optional<WeightChannel> weight = pointers_.to_weight(channel);
        const char *own = track(channel, sampler_texts, !points && !mesh && !weight);
        if (points) {
          points->preserved = own;
          pointers_.take(*std::move(points), static_cast<uint32_t>(i));
        } else if (mesh) {
          of_meshes.push_back({*mesh, static_cast<uint32_t>(i), channel, own});
        } else if (weight) {
          weight->index = static_cast<uint32_t>(i);
          weight->preserved = own;
          of_weights.push_back(*weight);
        } else if (is_track(channel)) {
          places.push_back({static_cast<uint32_t>(i), -1, -1});
          tracks.push_back(own);
        } else {
          append(loose, loose_channel(parsed, channel, own));
        }
      });
      check_parsed(tracks.size(), parsed.channels, text("/animations/", index, "/channels"));
      for (const MeshChannel &channel : of_meshes) { // behind those of nodes, which win
        place_ = text("/animations/", index, "/channels/", channel.index);
        if (!pointers_.take_nodes(channel, place_))
          append(loose, loose_channel(parsed, channel.text, channel.preserved));
      }
      pointers_.take_weights(of_weights, text("/animations/", index));
      for (const WeightChannel &channel : of_weights) {
        if (channel.is_taken) continue;
        place_ = text("/animations/", index, "/channels/", channel.index);
        document_.outline.lose(
            "channel of one morph weight moves nothing in poses: the channels of a node's weights "
            "need one accessor of times, one interpolation, and each a target of its own",
            "channels of one morph weight each move nothing in poses: the channels of a node's "
            "weights need one accessor of times, one interpolation, and each a target of its own");
        append(loose, loose_channel(parsed, channel.text, channel.preserved));
      }
      named.erase(-1);
      if (named.size() < parsed.samplers.size())
        document_.outline.lose("sampler of an animation is left out: no channel names it",
                               "samplers of animations are left out: no channel names them",
                               parsed.samplers.size() - named.size());
      document_.channel_texts.push_back(std::move(tracks));
      pointers_.end(places);
      model.clips[index].loose = close(loose);
    });
  }

  // Puts a channel that animates something else than a node into text_, with its sampler. own: what is
  // preserved of both, or nullptr.
  const Vector<char> &loose_channel(const tinygltf::Animation &parsed, const char *channel, const char *own) {
    const char *target = tw_json_member(channel, "target");
    int sampler = index_of(tw_json_member(channel, "sampler"));
    if (sampler < 0 || static_cast<size_t>(sampler) >= parsed.samplers.size())
      refuse(TW_INVALID, place_ + "/sampler", "there is no such sampler");
    if (!target) refuse(TW_INVALID, place_, "a channel needs a target");
    const tinygltf::AnimationSampler &keys = parsed.samplers[static_cast<size_t>(sampler)];
    if (!has_word("LINEAR STEP CUBICSPLINE", keys.interpolation))
      refuse(TW_INVALID, place_, "an interpolation is LINEAR, STEP or CUBICSPLINE");
    const char *more = tw_json_member(own, "channel");
    const char *sampler_more = tw_json_member(own, "sampler");
    uint32_t input = elements_.keep(keys.input, TIMES, place_),
             output = elements_.keep(keys.output, PLAIN, place_);
    collect(target, "");
    static constexpr char opening[] = "{\"channel\":{\"target\":";
    text_.insert(text_.begin(), opening, opening + sizeof opening - 1);
    put_inside(more);
    put(text("},\"sampler\":{\"input\":", input, ",\"interpolation\":\"", keys.interpolation,
             "\",\"output\":", output));
    put_inside(sampler_more);
    put("}}");
    return text_;
  }

  // Puts the members of a preserved object behind other members.
  void put_inside(const char *object) {
    if (!object) return;
    std::string_view whole = value_text(object);
    put(",");
    put(whole.substr(1, whole.size() - 2));
  }

  // Keeps the members of channel, target (unless it becomes another) and sampler as one object; a sampler
  // that several channels name is preserved with each.
  const char *track(const char *channel, const Vector<const char *> &samplers, bool keeps_target) {
    const char *own = object(channel, channel_members), *target = tw_json_member(channel, "target");
    const char *of_target = target && keeps_target ? object(target, target_members) : nullptr;
    int sampler = index_of(tw_json_member(channel, "sampler"));
    bool has_sampler = sampler >= 0 && static_cast<size_t>(sampler) < samplers.size();
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

  // ---- what is not preserved

  // Whether an accessor, buffer view or buffer says more than where numbers are.
  static bool says_more(const char *object) {
    for (Items i(object); i.more(); i.next()) {
      if (i.key() == "extensions" && !says_more_in_extensions(i.value())) continue;
      if (!has_word("bufferView byteOffset componentType normalized count type max min sparse indices values "
                    "buffer byteLength byteStride target uri",
                    i.key()) ||
          (*i.value() == '{' && says_more(i.value())))
        return true;
    }
    return false;
  }

  // Extensions that are no object have a warning of their own (Outline::misfit).
  static bool says_more_in_extensions(const char *extensions) {
    if (*extensions != '{') return false;
    for (Items i(extensions); i.more(); i.next())
      if (!has_word("EXT_meshopt_compression KHR_meshopt_compression", i.key())) return true;
    return false;
  }

  void count_unplaced(const char *member) {
    each(tw_json_member(document_.outline.root, member),
         [&](size_t, const char *value) { unplaced_ += says_more(value); });
  }

  void warn() {
    named_.tell();
    for (const DroppedExtension &dropped : dropped_)
      tw_model_warn(document_.model, "the extension %s at %s is left out: its data is in buffers%s",
                    dropped.name.c_str(), dropped.place.empty() ? "the root" : dropped.place.c_str(),
                    dropped.count > 1 ? text(", as at ", dropped.count - 1, " more ",
                                             tw_plural(dropped.count - 1, "place", "places"))
                                            .c_str()
                                      : "");
    count_unplaced("accessors");
    count_unplaced("bufferViews");
    count_unplaced("buffers");
    if (unplaced_ > 0)
      tw_model_warn(
          document_.model, "names, extras, extensions and unknown members of %zu %s are left out", unplaced_,
          tw_plural(unplaced_, "accessor, buffer view or buffer", "accessors, buffer views and buffers"));
  }
};

} // namespace

void keep_parts(Document &document, Accessors &accessors) {
  tw_gltf_assets *assets = allocate_zero<tw_gltf_assets>(document, 1);
  Preserver(document, accessors).run(*assets);
  document.assets = assets;
  document.model->assets = assets;
}

} // namespace gltf
