// Humanoid maps: which node is which bone of a person. Read from VRMC_vrm (VRM 1.0), VRM (0.x) and
// VRMC_vrm_animation (VRMA 1.0); the extensions themselves are kept for answers as any other.
#include "gltf/document.hpp"

#include <algorithm>
#include <cstring>

#include "tweend/retarget.h"

namespace gltf {

namespace {

constexpr char map_member[] = "/humanoid/humanBones";

class HumanoidReader {
public:
  HumanoidReader(Document &document, const std::string &place)
      : document_(document), place_(place), bones_(allocate<uint32_t>(document, TW_BONES)) {
    std::fill_n(bones_, size_t{TW_BONES}, TW_NO_INDEX);
  }

  // {"hips": {"node": 3}}
  void read_named(const char *bones) {
    if (*bones != '{') refuse(TW_INVALID, place_, "the bones of VRM 1.0 are an object");
    for (Items i(bones); i.more(); i.next()) {
      std::string name = unescape(i.key()), place = place_ + "/" + pointer_part(name);
      if (*i.value() != '{') refuse(TW_INVALID, place, "a bone is an object");
      add(name, name, tw_json_member(i.value(), "node"), place + "/node");
    }
  }

  // [{"bone": "hips", "node": 3}]. A bone that is not there may have node -1.
  void read_listed(const char *bones) {
    if (*bones != '[') refuse(TW_INVALID, place_, "the bones of VRM 0.x are an array");
    each(bones, [&](size_t index, const char *bone) {
      std::string place = text(place_, "/", index);
      if (*bone != '{') refuse(TW_INVALID, place, "a bone is an object");
      const char *name = tw_json_member(bone, "bone"), *node = tw_json_member(bone, "node");
      if (!name || *name != '"') refuse(TW_INVALID, place + "/bone", "a bone needs a name");
      if (node && value_text(node) == "-1") return;
      std::string written = unescape(string_of(name));
      add(written, newer_name(written), node, place + "/node");
    });
  }

  // nullptr where the map has no bone.
  const uint32_t *finish() {
    if (unknown_ > 0)
      tw_model_warn(document_.model, "%s: %zu %s %s", place_.c_str(), unknown_,
                    tw_plural(unknown_, "bone is left out: VRM knows no such name,",
                              "bones are left out: VRM knows no such names, the first is"),
                    first_unknown_.c_str());
    return count_ > 0 ? bones_ : nullptr;
  }

private:
  Document &document_;
  std::string place_, first_unknown_;
  uint32_t *bones_;
  size_t count_ = 0, unknown_ = 0;

  // What VRM 1.0 calls a bone of 0.x, whose thumbs are counted as other fingers are.
  static std::string newer_name(const std::string &name) {
    for (const char *side : {"left", "right"}) {
      if (name == text(side, "ThumbProximal")) return text(side, "ThumbMetacarpal");
      if (name == text(side, "ThumbIntermediate")) return text(side, "ThumbProximal");
    }
    return name;
  }

  void add(const std::string &written, const std::string &name, const char *node, const std::string &place) {
    uint64_t index = node ? whole_number(node).value_or(UINT64_MAX) : UINT64_MAX;
    if (index >= document_.model->node_count)
      refuse(TW_INVALID, place, "the bone needs the index of one of the ", document_.model->node_count,
             " nodes");
    uint32_t bone = tw_bone_find(name.data(), name.size());
    if (bone == TW_BONES) {
      if (unknown_++ == 0) first_unknown_ = printable(written);
      return;
    }
    if (bones_[bone] != TW_NO_INDEX)
      refuse(TW_INVALID, place, "the bone ", printable(written), " is there twice");
    for (uint32_t other = 0; other < TW_BONES; other++)
      if (bones_[other] == index)
        refuse(TW_INVALID, place, "node ", index, " is the bone ", tw_bone_names[other], " already");
    bones_[bone] = static_cast<uint32_t>(index);
    count_++;
  }
};

// Whether a member may be without a value that is read: the extensions of animations and of VRM 0.x need no
// humanoid map, VRM 1.0 does.
bool may_lack_bones(const char *extension, std::string_view name) {
  const char *humanoid = tw_json_member(extension, "humanoid");
  return *extension == '{' && !humanoid && name != "VRMC_vrm";
}

} // namespace

void read_humanoid(Document &document) {
  static constexpr const char *names[] = {"VRMC_vrm", "VRM", "VRMC_vrm_animation"};
  const char *extensions = tw_json_member(document.outline.root, "extensions");
  for (const char *name : names) {
    const char *extension = tw_json_member(extensions, name);
    if (!extension) continue;
    const char *bones = tw_json_member(tw_json_member(extension, "humanoid"), "humanBones");
    if (!bones) {
      if (!may_lack_bones(extension, name))
        document.outline.misfit(unfit_extension, [&] { return text("/extensions/", name); });
      continue;
    }
    document.budget.place = text("/extensions/", name, map_member);
    HumanoidReader reader(document, document.budget.place);
    const char *version = tw_json_member(extension, "specVersion");
    if (name == std::string_view("VRM"))
      reader.read_listed(bones);
    else
      reader.read_named(bones);
    if (name != std::string_view("VRM") && version && std::strncmp(version, "\"1.0\"", 5) != 0)
      document.outline.lose("humanoid map is of another version than VRM 1.0: it is read as one of 1.0",
                            "humanoid maps are of other versions than VRM 1.0: they are read as of 1.0");
    document.model->humanoid = reader.finish();
    return;
  }
}

} // namespace gltf
