// Surfaces must agree with OpenSubdiv: in connectivity, points (within 1e-5 of the cage's size), limit points
// and normals (1e-4), UVs (1e-5) and attributes of points, over hand-made and random cages, all options,
// levels 1 to 4. Prints TAP.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "comparison.hpp"
#include "tweend/format.h"

namespace {

int tests = 0, failures = 0, cases = 0;
// A sanitizer makes each case ten times slower, and fewer cases are enough for it.
const bool sanitized = std::getenv("TESTED_SANITIZED") != nullptr;

void compare(const Cage &cage, const tw_surface_options &options, std::string &first_failure) {
  cases++;
  std::string difference = Comparison(cage, options).run();
  if (!difference.empty() && first_failure.empty())
    first_failure = cage.name + ", " + text_of(options) + ": " + difference;
  if (!difference.empty()) failures++;
}

void conclude(const std::string &name, const std::string &first_failure) {
  tests++;
  std::printf("%sok %d - %s\n", first_failure.empty() ? "" : "not ", tests, name.c_str());
  if (!first_failure.empty()) std::printf("# %s\n", first_failure.c_str());
}

tw_surface_options options_of(tw_scheme scheme, uint32_t level, int boundary, int uv, bool chaikin,
                              bool smooth, bool limit) {
  tw_surface_options options{};
  options.level = level;
  options.boundary = static_cast<tw_boundary>(boundary);
  options.uv = static_cast<tw_uv_rule>(uv);
  options.creasing = chaikin ? TW_CREASE_CHAIKIN : TW_CREASE_UNIFORM;
  options.triangles = smooth ? TW_TRIANGLES_SMOOTH : TW_TRIANGLES_CATMULL_CLARK;
  options.scheme = scheme;
  options.limit = limit;
  options.normals = true;
  return options;
}

// Every combination of options at the first levels; where a case takes sixteen times as long, one in several,
// others for each cage. Their number is prime to the numbers of values, so that all values come together.
bool is_due(uint32_t level, size_t combination) {
  if (level <= 2 && !sanitized) return true;
  const size_t one_in = sanitized || level > 3 ? 23 : 5;
  return (combination + static_cast<size_t>(tests)) % one_in == 0;
}

void compare_hand_made(uint32_t levels) {
  for (const Cage &cage : hand_made()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++) {
      size_t combination = 0;
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.uv_sets.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 8; flags++)
            if (is_due(level, combination++))
              compare(cage,
                      options_of(TW_CATMULL_CLARK, level, boundary, uv, flags & 1, flags & 2, flags & 4),
                      failure);
    }
    for (uint32_t level = 1; level <= levels; level++)
      compare(cage, options_of(TW_BILINEAR, level, 0, 0, false, false, false), failure);
    conclude("opensubdiv agrees on " + cage.name, failure);
  }
  for (const Cage &cage : hand_made_triangles()) {
    std::string failure;
    for (uint32_t level = 1; level <= levels; level++) {
      size_t combination = 0;
      for (int boundary = 0; boundary < 3; boundary++)
        for (int uv = 0; uv < (cage.uv_sets.empty() ? 1 : 6); uv++)
          for (int flags = 0; flags < 4; flags++)
            if (is_due(level, combination++))
              compare(cage, options_of(TW_LOOP, level, boundary, uv, flags & 1, false, flags & 2), failure);
    }
    conclude("opensubdiv agrees by loop on " + cage.name, failure);
  }
}

// The cage as an OBJ file without tags; its reader may weld the points.
std::string obj_of(const Cage &cage) {
  std::string text;
  char number[32];
  for (size_t i = 0; i < cage.points.size(); i++) {
    std::snprintf(number, sizeof number, "%s%.9g", i % 3 ? " " : "\nv ", static_cast<double>(cage.points[i]));
    text += number;
  }
  for (const std::vector<int> &face : cage.faces) {
    text += "\nf";
    for (int point : face) text += " " + std::to_string(point + 1);
  }
  return text;
}

// Each point of a cage is unique, so welding must not join any.
void weld_nothing(const std::vector<Cage> &cages, const std::string &name) {
  std::string failure;
  for (const Cage &cage : cages) {
    std::string text = obj_of(cage);
    CageView view(cage);
    tw_model *model = nullptr;
    tw_status status = tw_obj_read(reinterpret_cast<const uint8_t *>(text.data()), text.size(), TW_WELD_AUTO,
                                   &model, nullptr);
    const tw_mesh *mesh = status == TW_OK ? model->meshes : nullptr;
    bool same = mesh && mesh->point_count == view.mesh.point_count &&
                mesh->face_count == view.mesh.face_count && mesh->corner_count == view.mesh.corner_count &&
                std::equal(mesh->corners, mesh->corners + mesh->corner_count, view.mesh.corners);
    if (!same && failure.empty()) failure = cage.name;
    tw_model_destroy(model);
  }
  conclude(name, failure);
}

// 1 to 4. Each level has four times as many faces as the one before it, and half as many cases.
uint32_t random_level(std::mt19937 &random) {
  const auto number = random() % 15;
  return number < 8 ? 1 : number < 12 ? 2 : number < 14 ? 3 : 4;
}

using MakeCage = Cage (*)(std::mt19937 &random);

void compare_random(tw_scheme scheme, int count, MakeCage make, const char *of) {
  std::mt19937 random(20261121);
  std::string failure;
  int failed_before = failures;
  for (int i = 0; i < count; i++) {
    Cage cage = make(random);
    uint32_t level = random_level(random);
    unsigned flags = static_cast<unsigned>(random() % 8);
    // In separate statements: the evaluation order of arguments is unspecified.
    int uv = static_cast<int>(random() % 6);
    int boundary = static_cast<int>(random() % 3);
    compare(cage, options_of(scheme, level, boundary, uv, flags & 1, flags & 2, flags & 4), failure);
  }
  static const char *const names[] = {"by catmull-clark", "by loop", "bilinearly"};
  conclude(std::string("opensubdiv agrees ") + names[scheme] + " on " + std::to_string(count) + of, failure);
  if (failures > failed_before) std::printf("# %d of the random cages differ\n", failures - failed_before);
}

} // namespace

// usage: opensubdiv_test [hand-made|random]    without an argument, both kinds of cages
int main(int argc, char **argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  if (only != "random") {
    compare_hand_made(sanitized ? 2 : 4);
    weld_nothing(hand_made(), "welding leaves hand-made cages as they are");
    weld_nothing(hand_made_triangles(), "welding leaves hand-made cages of triangles as they are");
  }
  if (only != "hand-made") {
    int random_count = sanitized ? 100 : 1500;
    const char *const of = " random cages";
    compare_random(TW_CATMULL_CLARK, random_count, random_cage, of);
    compare_random(TW_LOOP, random_count, random_triangle_cage, of);
    compare_random(TW_BILINEAR, random_count / 5, random_cage, of);
    returning_values = 0;
    compare_random(TW_CATMULL_CLARK, random_count / 3, random_alternating_cage,
                   " random cages with values that return");
    if (returning_values < random_count / 10) {
      conclude("values that return around a point are compared", "too few");
      failures++;
    }
  }
  const bool is_enough = compared_uvs > 100'000 && compared_colors > 100'000;
  conclude("values of corners are compared", is_enough ? "" : "too few");
  if (!is_enough) failures++;
  std::printf("1..%d\n# %d cases compared\n", tests, cases);
  std::printf("# %d UV sets left out: OpenSubdiv misreads them\n", misread_sets);
  std::printf("# %ld points around which a value returns\n", returning_values);
  std::printf("# at corners: %ld numbers of UVs, %ld of attributes\n", compared_uvs, compared_colors);
  static const char *const kinds[] = {"smooth",     "sides",     "corners",      "sharp amid",
                                      "semi-sharp", "valence 2", "non-manifold", "flat"};
  std::printf("# normals:");
  for (int kind = 0; kind < Oracle::KindCount; kind++)
    std::printf(" %ld %s", compared_normals[kind], kinds[kind]);
  std::printf("\n");
  return failures ? 1 : 0;
}
