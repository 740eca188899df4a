// Faces: the expressions and the gaze of a VRM (1.0 and 0.x), and the nodes of a VRMA that stand for such.
// The extensions themselves are kept for answers as any other. What does not fit is passed over with a
// warning: the file is a model without it too.
#include "gltf/document.hpp"

#include <cmath>
#include <iterator>

#include "tweend/face.h"

namespace gltf {

namespace {

constexpr float number_max = 1e6F;
constexpr size_t expressions_max = 1024;

std::optional<float> number_of(const char *value) {
  if (!value || (*value != '-' && (*value < '0' || *value > '9'))) return {};
  std::string_view written = value_text(value);
  double number = 0;
  tw_read_double(written.data(), written.size(), &number);
  if (!(std::fabs(number) <= static_cast<double>(number_max))) return {};
  return static_cast<float>(number);
}

bool is_object(const char *value) {
  return value && *value == '{';
}

// A member's text; nothing for a value that is no string.
std::optional<std::string> word_of(const char *value) {
  if (!value || *value != '"') return {};
  return unescape(string_of(value));
}

bool has_elements(const char *array) {
  return array && *array == '[' && tw_json_count(array) > 0;
}

class FaceReader {
public:
  FaceReader(Document &document, const char *extension)
      : document_(document), place_(text("/extensions/", extension)), expressions_(document.budget),
        binds_(document.budget), shows_(document.budget) {}

  // VRMC_vrm.
  const tw_face *read_newer(const char *vrm) {
    const char *expressions = tw_json_member(vrm, "expressions");
    for (const char *kind : {"preset", "custom"})
      read_each(expressions, kind, [&](const std::string &name, const char *value, const std::string &place) {
        bool is_preset = kind == std::string_view("preset");
        if (tw_is_preset_expression(name.c_str()) != is_preset || name.empty() || !is_object(value))
          return misfit(place);
        add_newer(name, value, place);
      });
    const char *gaze = tw_json_member(vrm, "lookAt");
    if (gaze && !is_object(gaze)) misfit(place_ + "/lookAt");
    if (is_object(gaze)) read_newer_gaze(gaze);
    return finish();
  }

  // VRM 0.x.
  const tw_face *read_older(const char *vrm) {
    face_.faces_back = true;
    find_shows();
    const char *groups = tw_json_member(tw_json_member(vrm, "blendShapeMaster"), "blendShapeGroups");
    each(groups, [&](size_t index, const char *group) {
      std::string place = text(place_, "/blendShapeMaster/blendShapeGroups/", index);
      if (!is_object(group)) return misfit(place);
      add_older(group, place);
    });
    const char *gaze = tw_json_member(vrm, "firstPerson");
    if (is_object(gaze)) read_older_gaze(gaze);
    return finish();
  }

  // VRMC_vrm_animation.
  const tw_face_nodes *read_nodes(const char *animation) {
    Vector<tw_expression_node> nodes(document_.budget);
    const char *expressions = tw_json_member(animation, "expressions");
    for (const char *kind : {"preset", "custom"})
      read_each(expressions, kind, [&](const std::string &name, const char *value, const std::string &place) {
        bool is_preset = kind == std::string_view("preset");
        uint32_t node = node_of(tw_json_member(value, "node"));
        if (tw_is_preset_expression(name.c_str()) != is_preset || node == TW_NO_INDEX || is_bone(node) ||
            name.empty() || tw_face_part_of(name.c_str()) == TW_FACE_GAZE) // the gaze has its own node
          return misfit(place);
        if (has_room(nodes.size()) && names_.insert(name).second)
          nodes.push_back({copy_name(document_, name), node});
      });
    const char *gaze = tw_json_member(tw_json_member(animation, "lookAt"), "node");
    uint32_t gaze_node = node_of(gaze);
    if (gaze && (gaze_node == TW_NO_INDEX || is_bone(gaze_node))) {
      misfit(place_ + "/lookAt/node");
      gaze_node = TW_NO_INDEX;
    }
    if (nodes.empty() && gaze_node == TW_NO_INDEX) return nullptr;
    tw_face_nodes *out = allocate<tw_face_nodes>(document_, 1);
    *out = {static_cast<uint32_t>(nodes.size()), keep(nodes), gaze_node};
    return out;
  }

private:
  static constexpr size_t binds_max = 1 << 18; // a mesh of VRM 0.x may be shown by many nodes

  Document &document_;
  std::string place_;
  tw_face face_ = {};
  Vector<tw_expression> expressions_;
  Vector<tw_morph_bind> binds_; // of one expression
  size_t bind_count_ = 0;       // of all
  std::set<std::string> names_;
  Vector<std::pair<uint32_t, uint32_t>> shows_; // (mesh, node), ascending

  void misfit(const std::string &place) {
    document_.outline.misfit(unfit_extension, [&] { return place; });
  }

  template <typename Element> const Element *keep(const Vector<Element> &elements) {
    Element *out = allocate<Element>(document_, elements.size());
    std::copy(elements.begin(), elements.end(), out);
    return out;
  }

  // Calls take(name, value, place) for each member of a member.
  template <typename Take> void read_each(const char *expressions, const char *kind, Take take) {
    const char *all = tw_json_member(expressions, kind);
    std::string place = place_ + "/expressions/" + kind;
    if (!all) return;
    if (*all != '{') return misfit(place);
    for (Items i(all); i.more(); i.next()) {
      std::string name = unescape(i.key());
      take(name, i.value(), place + "/" + pointer_part(name));
    }
  }

  uint32_t node_of(const char *value) const {
    uint64_t index = value ? whole_number(value).value_or(UINT64_MAX) : UINT64_MAX;
    return index < document_.model->node_count ? static_cast<uint32_t>(index) : TW_NO_INDEX;
  }

  bool is_bone(uint32_t node) const {
    const uint32_t *bones = document_.model->humanoid;
    return bones && std::find(bones, bones + TW_BONES, node) != bones + TW_BONES;
  }

  // The morph target that a value names; nothing where the mesh has none such.
  std::optional<uint32_t> target_of(uint32_t mesh, const char *value) const {
    uint64_t index = value ? whole_number(value).value_or(UINT64_MAX) : UINT64_MAX;
    if (index >= document_.model->meshes[mesh].morph_count) return {};
    return static_cast<uint32_t>(index);
  }

  // Whether so many more binds are kept; else they are left out.
  bool may_bind(uint64_t count) {
    if (count > binds_max - bind_count_) {
      document_.outline.lose("bind of an expression is left out: there are too many",
                             "binds of expressions are left out: there are too many", count);
      return false;
    }
    bind_count_ += count;
    return true;
  }

  // The weight of a bind; nothing, and noted, where it is none.
  std::optional<float> weight_of(const char *bind, float otherwise, const std::string &place) {
    const char *weight = tw_json_member(bind, "weight");
    if (!weight) return otherwise;
    std::optional<float> number = number_of(weight);
    if (!number) misfit(place + "/weight");
    return number;
  }

  // Whether another expression is kept: each is sought among all others and among the tracks of a clip.
  bool has_room(size_t count) {
    if (count >= expressions_max)
      document_.outline.lose("expression is left out: there are too many",
                             "expressions are left out: there are too many");
    return count < expressions_max;
  }

  void add(const std::string &name, tw_expression expression) {
    if (!has_room(expressions_.size())) return;
    if (!names_.insert(name).second)
      return document_.outline.lose("expression is left out: it has the name of one before",
                                    "expressions are left out: they have the names of others before");
    expression.name = copy_name(document_, name);
    expression.binds = keep(binds_);
    expression.bind_count = static_cast<uint32_t>(binds_.size());
    expressions_.push_back(expression);
  }

  // ---- VRM 1.0

  void bind_node(const char *bound, float weight, const std::string &place) {
    uint32_t node = node_of(tw_json_member(bound, "node"));
    uint32_t mesh = node == TW_NO_INDEX ? TW_NO_INDEX : document_.model->nodes[node].mesh;
    std::optional<uint32_t> target;
    if (mesh != TW_NO_INDEX) target = target_of(mesh, tw_json_member(bound, "index"));
    if (!target) return misfit(place);
    if (may_bind(1)) binds_.push_back({node, *target, weight});
  }

  void add_newer(const std::string &name, const char *value, const std::string &place) {
    static constexpr const char *members[TW_FACE_PARTS] = {"overrideBlink", "overrideLookAt",
                                                           "overrideMouth"};
    tw_expression expression = {};
    const char *binary = tw_json_member(value, "isBinary");
    expression.is_binary = binary && *binary == 't';
    for (int part = 0; part < TW_FACE_PARTS; part++) {
      std::optional<std::string> word = word_of(tw_json_member(value, members[part]));
      for (int way = TW_OVERRIDE_NONE; word && way <= TW_OVERRIDE_BLEND; way++)
        if (*word == tw_override_names[way]) expression.overrides[part] = static_cast<tw_override>(way);
    }
    binds_.clear();
    each(tw_json_member(value, "morphTargetBinds"), [&](size_t index, const char *bound) {
      std::string at = text(place, "/morphTargetBinds/", index);
      std::optional<float> weight = weight_of(bound, 1, at);
      if (weight) bind_node(bound, *weight, at);
    });
    expression.moves_materials = has_elements(tw_json_member(value, "materialColorBinds")) ||
                                 has_elements(tw_json_member(value, "textureTransformBinds"));
    add(name, expression);
  }

  tw_gaze_range range(const char *map, const char *input, const char *output, float scale,
                      const std::string &place) {
    constexpr float least = 0.01F;
    tw_gaze_range out = {90, scale, 0, nullptr};
    const char *most = tw_json_member(map, input), *scaled = tw_json_member(map, output);
    if ((most && !number_of(most)) || (scaled && !number_of(scaled))) misfit(place);
    out.most = std::max(number_of(most).value_or(out.most), least);
    out.scale = number_of(scaled).value_or(out.scale);
    return out;
  }

  void read_newer_gaze(const char *gaze) {
    std::optional<std::string> type = word_of(tw_json_member(gaze, "type"));
    face_.gaze = type && *type == "expression" ? TW_GAZE_EXPRESSIONS : TW_GAZE_BONES;
    auto read = [&](const char *member) {
      return range(tw_json_member(gaze, member), "inputMaxValue", "outputScale",
                   face_.gaze == TW_GAZE_BONES ? 10 : 1, place_ + "/lookAt/" + member);
    };
    face_.inner = read("rangeMapHorizontalInner");
    face_.outer = read("rangeMapHorizontalOuter");
    face_.down = read("rangeMapVerticalDown");
    face_.up = read("rangeMapVerticalUp");
  }

  // ---- VRM 0.x

  void find_shows() {
    const tw_model &model = *document_.model;
    for (uint32_t i = 0; i < model.node_count; i++)
      if (model.nodes[i].mesh != TW_NO_INDEX) shows_.push_back({model.nodes[i].mesh, i});
    std::sort(shows_.begin(), shows_.end());
  }

  // The name of an expression in VRM 1.0.
  static std::optional<std::string> newer_name(const char *group) {
    static constexpr std::pair<const char *, const char *> presets[] = {{"neutral", "neutral"},
                                                                        {"a", "aa"},
                                                                        {"i", "ih"},
                                                                        {"u", "ou"},
                                                                        {"e", "ee"},
                                                                        {"o", "oh"},
                                                                        {"blink", "blink"},
                                                                        {"joy", "happy"},
                                                                        {"angry", "angry"},
                                                                        {"sorrow", "sad"},
                                                                        {"fun", "relaxed"},
                                                                        {"lookup", "lookUp"},
                                                                        {"lookdown", "lookDown"},
                                                                        {"lookleft", "lookLeft"},
                                                                        {"lookright", "lookRight"},
                                                                        {"blink_l", "blinkLeft"},
                                                                        {"blink_r", "blinkRight"}};
    std::optional<std::string> preset = word_of(tw_json_member(group, "presetName"));
    for (const auto &[older, newer] : presets)
      if (preset && *preset == older) return newer;
    return word_of(tw_json_member(group, "name"));
  }

  void add_older(const char *group, const std::string &place) {
    std::optional<std::string> name = newer_name(group);
    if (!name || name->empty()) return misfit(place);
    tw_expression expression = {};
    const char *binary = tw_json_member(group, "isBinary");
    expression.is_binary = binary && *binary == 't';
    binds_.clear();
    each(tw_json_member(group, "binds"), [&](size_t index, const char *bound) {
      std::string at = text(place, "/binds/", index);
      std::optional<float> weight = weight_of(bound, 100, at);
      if (weight) bind_mesh(bound, *weight / 100, at);
    });
    expression.moves_materials = has_elements(tw_json_member(group, "materialValues"));
    add(*name, expression);
  }

  // Binds a target on all nodes that show a mesh.
  void bind_mesh(const char *bound, float weight, const std::string &place) {
    const char *value = tw_json_member(bound, "mesh");
    uint64_t mesh = value ? whole_number(value).value_or(UINT64_MAX) : UINT64_MAX;
    if (mesh >= document_.model->mesh_count) return misfit(place);
    uint32_t index = static_cast<uint32_t>(mesh);
    std::optional<uint32_t> target = target_of(index, tw_json_member(bound, "index"));
    if (!target) return misfit(place);
    using Shown = std::pair<uint32_t, uint32_t>;
    auto at = std::lower_bound(shows_.begin(), shows_.end(), Shown(index, 0));
    auto end = std::upper_bound(at, shows_.end(), Shown(index, TW_NO_INDEX));
    if (!may_bind(static_cast<uint64_t>(end - at))) return;
    for (; at != end; ++at) binds_.push_back({at->second, *target, weight});
  }

  // The keys of a curve, of four numbers each: time, value, slopes before and behind it. None of a straight
  // line, which is what most files have.
  void read_curve(const char *curve, tw_gaze_range &range, const std::string &place) {
    static constexpr float line[] = {0, 0, 0, 1, 1, 1, 1, 0};
    constexpr size_t key_numbers = 4, keys_most = 64;
    Vector<float> numbers(document_.budget);
    bool fits = curve && *curve == '[' && tw_json_count(curve) <= key_numbers * keys_most;
    if (fits)
      each(curve, [&](size_t, const char *value) {
        std::optional<float> number = number_of(value);
        fits = fits && number;
        numbers.push_back(number.value_or(0));
      });
    fits = fits && !numbers.empty() && numbers.size() % key_numbers == 0;
    for (size_t i = key_numbers; fits && i < numbers.size(); i += key_numbers)
      fits = numbers[i] > numbers[i - key_numbers];
    if (curve && !fits) misfit(place);
    if (!fits || std::equal(numbers.begin(), numbers.end(), std::begin(line), std::end(line))) return;
    tw_curve_key *keys = allocate<tw_curve_key>(document_, numbers.size() / key_numbers);
    for (size_t i = 0; i < numbers.size() / key_numbers; i++) {
      const float *key = &numbers[key_numbers * i];
      keys[i] = {key[0], key[1], key[2], key[3]};
    }
    range.keys = keys;
    range.key_count = static_cast<uint32_t>(numbers.size() / key_numbers);
  }

  void read_older_gaze(const char *person) {
    std::optional<std::string> type = word_of(tw_json_member(person, "lookAtTypeName"));
    face_.gaze = type && *type == "BlendShape" ? TW_GAZE_EXPRESSIONS
                 : type && *type == "None"     ? TW_GAZE_NONE
                                               : TW_GAZE_BONES;
    auto read = [&](const char *member) {
      const char *map = tw_json_member(person, member);
      std::string place = place_ + "/firstPerson/" + member;
      tw_gaze_range out = range(map, "xRange", "yRange", face_.gaze == TW_GAZE_BONES ? 10 : 1, place);
      read_curve(tw_json_member(map, "curve"), out, place + "/curve");
      return out;
    };
    face_.inner = read("lookAtHorizontalInner");
    face_.outer = read("lookAtHorizontalOuter");
    face_.down = read("lookAtVerticalDown");
    face_.up = read("lookAtVerticalUp");
  }

  // nullptr where the file says nothing of a face.
  const tw_face *finish() {
    if (expressions_.empty() && face_.gaze == TW_GAZE_NONE) return nullptr;
    face_.expressions = keep(expressions_);
    face_.expression_count = static_cast<uint32_t>(expressions_.size());
    tw_face *out = allocate<tw_face>(document_, 1);
    *out = face_;
    return out;
  }
};

} // namespace

void read_face(Document &document) {
  const char *extensions = tw_json_member(document.outline.root, "extensions");
  auto find = [&](const char *name) {
    const char *extension = tw_json_member(extensions, name);
    return is_object(extension) ? extension : nullptr;
  };
  document.budget.place = "/extensions";
  tw_model &model = *document.model;
  if (const char *newer = find("VRMC_vrm"))
    model.face = FaceReader(document, "VRMC_vrm").read_newer(newer);
  else if (const char *older = find("VRM"))
    model.face = FaceReader(document, "VRM").read_older(older);
  if (const char *animation = find("VRMC_vrm_animation"))
    model.face_nodes = FaceReader(document, "VRMC_vrm_animation").read_nodes(animation);
}

} // namespace gltf
