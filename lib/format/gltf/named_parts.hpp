// Which accessors and buffer views of a document something names that is read, or that is left out with a
// warning of its own; answers have no others.
#ifndef TWEEND_GLTF_NAMED_PARTS_HPP
#define TWEEND_GLTF_NAMED_PARTS_HPP

#include <algorithm>

#include "gltf/document.hpp"

namespace gltf {

class NamedParts {
public:
  explicit NamedParts(Document &document)
      : document_(document), accessors_(document.budget, document.source.accessors.size()),
        views_(document.budget, document.source.bufferViews.size()) {}

  // Marks the accessors that the members of an object name. object: or nullptr.
  void mark_accessors(const char *object) {
    if (object && *object == '{')
      for (Items i(object); i.more(); i.next()) mark(accessors_, i.value());
  }

  void mark_primitive(const char *primitive) {
    mark_accessors(tw_json_member(primitive, "attributes"));
    mark(accessors_, tw_json_member(primitive, "indices"));
    each(tw_json_member(primitive, "targets"), [&](size_t, const char *target) { mark_accessors(target); });
  }

  // sampler: of an animation.
  void mark_sampler(const char *sampler) {
    mark(accessors_, tw_json_member(sampler, "input"));
    mark(accessors_, tw_json_member(sampler, "output"));
  }

  // Marks what any number in a value that is left out may name.
  void mark_all(const char *value) {
    mark(accessors_, value);
    mark(views_, value);
    if (*value != '{' && *value != '[') return;
    for (Items i(value); i.more(); i.next()) mark_all(i.value());
  }

  // Tells of accessors and buffer views that answers do not have, because nothing names them.
  void tell() {
    const char *root = document_.outline.root;
    each(tw_json_member(root, "skins"),
         [&](size_t, const char *skin) { mark(accessors_, tw_json_member(skin, "inverseBindMatrices")); });
    each(tw_json_member(root, "images"),
         [&](size_t, const char *image) { mark(views_, tw_json_member(image, "bufferView")); });
    each(tw_json_member(root, "accessors"), [&](size_t, const char *accessor) {
      const char *sparse = tw_json_member(accessor, "sparse");
      mark(views_, tw_json_member(accessor, "bufferView"));
      for (const char *part : {"indices", "values"})
        mark(views_, tw_json_member(tw_json_member(sparse, part), "bufferView"));
    });
    each(tw_json_member(root, "bufferViews"), [&](size_t i, const char *view) { // empty ones are told apart
      if (i < views_.size() && whole_number(tw_json_member(view, "byteLength")) == 0) views_[i] = true;
    });
    document_.outline.lose("accessor is left out: nothing that is read names it",
                           "accessors are left out: nothing that is read names them",
                           count_unnamed(accessors_));
    document_.outline.lose("buffer view is left out: nothing that is read names it",
                           "buffer views are left out: nothing that is read names them",
                           count_unnamed(views_));
  }

private:
  Document &document_;
  Vector<bool> accessors_, views_;

  // Marks what a member names. index: its value, or nullptr.
  static void mark(Vector<bool> &named, const char *index) {
    uint64_t i = whole_number(index).value_or(named.size());
    if (i < named.size()) named[static_cast<size_t>(i)] = true;
  }

  static uint64_t count_unnamed(const Vector<bool> &named) {
    return static_cast<uint64_t>(std::count(named.begin(), named.end(), false));
  }
};

} // namespace gltf

#endif
