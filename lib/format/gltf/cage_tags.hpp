// What an answer that is a cage says of itself in extras.tweend of a mesh, see tw_gltf_stream.
#ifndef TWEEND_GLTF_CAGE_TAGS_HPP
#define TWEEND_GLTF_CAGE_TAGS_HPP

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
      : document_(document), accessors_(accessors), index_(mesh), mesh_(document.model->meshes[mesh]) {}

  // Opens what the extras name. positions: of all vertices, nullptr where primitives have more than one.
  // Another program may have kept the extras and made other accessors: then they are left out, with a
  // warning.
  void open(const char *extras, const Elements *positions);

  bool are_there() const { return points_ != nullptr; }
  const std::vector<Hole> &holes() const { return holes_; }
  uint32_t point_of(uint32_t vertex) const { return points_->read_index(vertex); }

  // Puts the mesh, whose faces are those of the file, of holes the last ones, into the order that it had, and
  // tags it.
  void write(uint32_t hole_faces);

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
  std::vector<Hole> holes_;

  std::string place_of(const char *name) const;
  const Elements *open_tag(const char *object, const char *name, bool is_float);
  void check_points(const Elements *positions) const;
  void open_holes(const char *holes, const Elements &positions);
  void open_details(const char *details);
  void read_face_order(Vector<uint32_t> &place) const;
  void check_starts() const;
  static bool is_identity(const Vector<uint32_t> &place);
  void reorder_corners(const uint32_t *&values, const Vector<uint32_t> &place);
  void reorder_faces(const Vector<uint32_t> &place);
  void check_sharpness(const char *name, const Elements *points, const Elements *sharpness,
                       uint32_t width) const;
  uint32_t write_sharpness(const Elements *points, const Elements *sharpness, const uint32_t *&to,
                           const float *&sharpness_to);
  void write_holes(const Vector<uint32_t> &place, uint32_t count);
  uint32_t group_number(const std::string &name);
  void write_groups(const Vector<uint32_t> &place);
  static int rule(const char *rules, const char *name, int most);
  void write_rules();
  void check_details() const;
  void write_details();
  void leave_out(const Refusal &refusal);
};

} // namespace gltf

#endif
