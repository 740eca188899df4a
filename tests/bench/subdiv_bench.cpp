// Subdivision beside OpenSubdiv, both measured in this one run: from polygon soup to points and quad
// indices, what limit normals add, and new positions on a topology that is known.
// usage: subdiv_bench [--only=NAME] [--json=FILE] [OBJ...]   an OBJ file joins at levels 1 to 3
//        subdiv_bench --print-ball=N                          prints a cage of 6 N N quads as OBJ, or
//        subdiv_bench --print-isosurface=N, --print-character=N   one of those of soups.hpp
//        subdiv_bench --peer OBJ LEVEL    prints the seconds of OpenSubdiv with limit tangents
#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "opensubdiv_peer.hpp"
#include "soups.hpp"
#include "timing.hpp"
#include "tweend/subdiv.h"

namespace {

Soup unskinned(Soup soup) {
  soup.joints.clear();
  soup.weights.clear();
  return soup;
}

struct Case {
  std::string name;
  Soup soup;
  std::vector<unsigned> levels;
  tw_scheme scheme = TW_CATMULL_CLARK;
};

// ---- tweend ----------------------------------------------------------------------------------

// Buffers that are used again, as a stream uses its blocks again.
std::vector<float> row_buffer;
std::vector<uint32_t> face_buffer;

void make_room(const tw_surface *surface) {
  size_t rows = static_cast<size_t>(tw_surface_row_count(surface, TW_DOMAIN_VERTICES));
  size_t need = rows * tw_surface_get_layout(surface)->stride;
  if (row_buffer.size() < need) row_buffer.resize(need);
  size_t corners = static_cast<size_t>(tw_surface_get_counts(surface)->corners);
  if (face_buffer.size() < corners) face_buffer.resize(corners);
}

struct Share {
  unsigned index, count;

  uint64_t first(uint64_t all) const { return all * index / count; }
  size_t size(uint64_t all) const { return static_cast<size_t>(all * (index + 1) / count - first(all)); }
};

void read_share(const tw_surface *surface, bool faces, Share share) {
  tw_surface_reader *reader = tw_surface_reader_create(surface);
  size_t stride = tw_surface_get_layout(surface)->stride;
  uint64_t rows = tw_surface_row_count(surface, TW_DOMAIN_VERTICES);
  tw_surface_read_rows(reader, TW_DOMAIN_VERTICES, share.first(rows), share.size(rows),
                       row_buffer.data() + share.first(rows) * stride);
  uint64_t all = tw_surface_get_counts(surface)->faces;
  uint64_t corners_a_face = all > 0 ? tw_surface_get_counts(surface)->corners / all : 0;
  if (faces)
    tw_surface_read_faces(reader, TW_DOMAIN_VERTICES, share.first(all), share.size(all), nullptr,
                          face_buffer.data() + corners_a_face * share.first(all));
  tw_surface_reader_destroy(reader);
}

void read_all(const tw_surface *surface, bool faces, unsigned shares) {
  make_room(surface);
  std::vector<std::thread> others;
  for (unsigned share = 1; share < shares; share++)
    others.emplace_back(read_share, surface, faces, Share{share, shares});
  read_share(surface, faces, {0, shares});
  for (std::thread &other : others) other.join();
}

[[noreturn]] void give_up(const tw_error &error) {
  std::fprintf(stderr, "%s\n", error.detail);
  std::exit(1);
}

// One more thread that takes parts of what is shared out, as the daemon's pool does.
class Helper {
public:
  Helper() : thread_([this] { help(); }) {}
  Helper(const Helper &) = delete;
  Helper &operator=(const Helper &) = delete;
  ~Helper() {
    {
      std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

  tw_parallel_for parallel() { return {this, run, nullptr}; }

private:
  using Part = void (*)(void *context, uint32_t index);

  static void run(void *owner, uint32_t count, Part part, void *context) {
    auto *self = static_cast<Helper *>(owner);
    std::unique_lock lock(self->mutex_);
    self->part_ = part;
    self->context_ = context;
    self->next_ = 0;
    self->count_ = count;
    self->wake_.notify_one();
    self->take(lock);
    self->idle_.wait(lock, [&] { return !self->busy_; });
  }
  void take(std::unique_lock<std::mutex> &lock) {
    while (next_ < count_) {
      uint32_t index = next_++;
      lock.unlock();
      part_(context_, index);
      lock.lock();
    }
  }
  void help() {
    std::unique_lock lock(mutex_);
    for (;;) {
      wake_.wait(lock, [&] { return stopping_ || next_ < count_; });
      if (stopping_) return;
      busy_ = true;
      take(lock);
      busy_ = false;
      idle_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_, idle_;
  Part part_ = nullptr;
  void *context_ = nullptr;
  uint32_t next_ = 0, count_ = 0;
  bool busy_ = false, stopping_ = false;
  std::thread thread_;
};

tw_surface *create(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals, bool movable,
                   Helper *helper = nullptr) {
  tw_surface_options options{};
  options.scheme = scheme;
  options.level = level;
  options.normals = normals;
  options.movable = movable;
  tw_surface *surface = nullptr;
  tw_error error{};
  tw_parallel_for parallel = helper ? helper->parallel() : tw_parallel_for{};
  if (tw_surface_create_by(&mesh, &options, helper ? &parallel : nullptr, &surface, &error) != TW_OK)
    give_up(error);
  return surface;
}

void subdivide(const tw_mesh &mesh, tw_scheme scheme, unsigned level, bool normals,
               Helper *helper = nullptr) {
  tw_surface *surface = create(mesh, scheme, level, normals, false, helper);
  read_all(surface, true, helper ? 2 : 1);
  tw_surface_destroy(surface);
}

Timing move(const tw_surface *known, const float *positions, unsigned threads) {
  std::optional<Helper> helper;
  if (threads > 1) helper.emplace();
  tw_parallel_for parallel = helper ? helper->parallel() : tw_parallel_for{};
  return measure([&] {
    tw_surface *surface = nullptr;
    tw_error error{};
    if (tw_surface_with_positions_by(known, positions, helper ? &parallel : nullptr, &surface) != TW_OK)
      give_up(error);
    read_all(surface, false, threads);
    tw_surface_destroy(surface);
  });
}

// ---- reports ---------------------------------------------------------------------------------

// Numbers of one case, by name: a line of the table and an object in the JSON file.
class Report {
public:
  explicit Report(const char *file) : json_(file ? std::fopen(file, "w") : nullptr) {
    if (file && !json_) {
      std::perror(file);
      std::exit(1);
    }
  }
  Report(const Report &) = delete;
  Report &operator=(const Report &) = delete;
  ~Report() {
    if (!json_) return;
    std::fprintf(json_, "%s]\n", first_ ? "[" : "\n");
    std::fclose(json_);
  }

  void title(const char *what, const std::vector<const char *> &columns) {
    what_ = what;
    std::printf("\n%-36s", what);
    for (const char *column : columns) std::printf(" %14s", column);
    std::printf("   spread\n");
  }
  void row(const std::string &name, double faces, const std::vector<std::pair<const char *, Timing>> &times) {
    std::printf("%-36s", name.c_str());
    if (json_)
      std::fprintf(json_, "%s\n{\"table\":\"%s\",\"case\":\"%s\",\"faces\":%.0f", first_ ? "[" : ",", what_,
                   name.c_str(), faces);
    first_ = false;
    for (const auto &[column, t] : times) {
      std::printf(" %14.1f", faces / t.median / 1e6);
      if (json_) std::fprintf(json_, ",\"%s_s\":[%g,%g,%g]", column, t.low, t.median, t.high);
    }
  }
  void ratio(const char *name, double value) {
    std::printf(" %14.1f", value);
    if (json_) std::fprintf(json_, ",\"%s\":%.3g", name, value);
  }
  void end(const std::vector<Timing> &times) {
    std::printf("  ");
    for (const Timing &t : times) std::printf(" %.0f%%", 100 * t.spread());
    std::printf("\n");
    std::fflush(stdout);
    if (json_) std::fprintf(json_, "}");
  }

private:
  std::FILE *json_;
  const char *what_ = "";
  bool first_ = true;
};

std::string label(const Case &c, unsigned level) {
  return c.name + " level " + std::to_string(level);
}

double face_count(const tw_mesh &mesh, tw_scheme scheme, unsigned level) {
  tw_surface_options options{};
  options.scheme = scheme;
  options.level = level;
  tw_surface_counts counts{};
  tw_error error{};
  if (tw_surface_count(&mesh, &options, &counts, &error) != TW_OK) give_up(error);
  return static_cast<double>(counts.faces);
}

void compare_soups(Report &report, const std::vector<Case> &cases) {
  report.title("soup to points and indices, Mfaces/s",
               {"tweend", "2 threads", "OpenSubdiv", "ratio", "ratio, 2 thr."});
  for (const Case &c : cases)
    for (unsigned level : c.levels) {
      tw_mesh mesh = c.soup.mesh();
      Helper helper;
      Timing one = measure([&] { subdivide(mesh, c.scheme, level, false); }),
             two = measure([&] { subdivide(mesh, c.scheme, level, false, &helper); });
      Timing peer = opensubdiv::subdivide(mesh, c.scheme, level, false);
      report.row(label(c, level), face_count(mesh, c.scheme, level),
                 {{"tweend", one}, {"tweend_2_threads", two}, {"opensubdiv", peer}});
      report.ratio("ratio", peer.median / one.median);
      report.ratio("ratio_2_threads", peer.median / two.median);
      report.end({one, two, peer});
    }
}

void compare_normals(Report &report, const std::vector<Case> &cases) {
  report.title("limit normals as well, Mfaces/s",
               {"without", "with", "OpenSubdiv", "ratio", "time, of without"});
  for (const Case &c : cases)
    for (unsigned level : c.levels) {
      tw_mesh mesh = c.soup.mesh();
      auto [without, with] = measure_by_turns([&] { subdivide(mesh, c.scheme, level, false); },
                                              [&] { subdivide(mesh, c.scheme, level, true); });
      Timing peer = opensubdiv::subdivide(mesh, c.scheme, level, true);
      report.row(label(c, level), face_count(mesh, c.scheme, level),
                 {{"without", without}, {"with", with}, {"opensubdiv", peer}});
      report.ratio("ratio", peer.median / with.median);
      report.ratio("with_over_without", with.median / without.median);
      report.end({without, with, peer});
    }
}

// Of Catmull-Clark surfaces.
void compare_moves(Report &report, const std::vector<Case> &cases) {
  report.title("new positions on a plan, Mfaces/s",
               {"tweend", "2 threads", "stencils", "stencils, 2", "interpolation", "ratio", "ratio, 2 thr."});
  for (const Case &c : cases)
    for (unsigned level : c.levels) {
      if (c.scheme != TW_CATMULL_CLARK) continue;
      tw_mesh mesh = c.soup.mesh();
      std::vector<float> positions = c.soup.moved();
      tw_surface *known = create(mesh, c.scheme, level, false, true);
      Timing one = move(known, positions.data(), 1), two = move(known, positions.data(), 2);
      tw_surface_destroy(known);
      opensubdiv::Moved peer(mesh, level);
      Timing stencils = peer.stencils(positions.data());
      Timing threads = peer.stencils_on_threads(positions.data(), 2);
      Timing interpolation = peer.interpolation(positions.data());
      report.row(label(c, level), face_count(mesh, c.scheme, level),
                 {{"tweend", one},
                  {"tweend_2_threads", two},
                  {"stencils", stencils},
                  {"stencils_2_threads", threads},
                  {"interpolation", interpolation}});
      double best = std::min(stencils.median, interpolation.median);
      report.ratio("ratio", best / one.median);
      report.ratio("ratio_2_threads", std::min(best, threads.median) / two.median);
      report.end({one, two, stencils, threads, interpolation});
    }
}

int print_peer(const char *obj, const char *level) {
  Soup soup = read_obj(obj);
  Timing peer =
      opensubdiv::subdivide(soup.mesh(), TW_CATMULL_CLARK, static_cast<unsigned>(std::atoi(level)), true);
  return std::printf("%g %.0f%%\n", peer.median, 100 * peer.spread()) < 0;
}

int print_obj(const Soup &soup) {
  for (size_t i = 0; i < soup.points.size(); i += 3)
    std::printf("v %.9g %.9g %.9g\n", static_cast<double>(soup.points[i]),
                static_cast<double>(soup.points[i + 1]), static_cast<double>(soup.points[i + 2]));
  for (size_t i = 0; i < soup.uvs.size(); i += 2)
    std::printf("vt %.9g %.9g\n", static_cast<double>(soup.uvs[i]), static_cast<double>(soup.uvs[i + 1]));
  for (size_t f = 0; f + 1 < soup.offsets.size(); f++) {
    std::printf("f");
    for (uint32_t i = soup.offsets[f]; i < soup.offsets[f + 1]; i++) {
      std::printf(" %u", soup.corners[i] + 1);
      if (!soup.uvs.empty()) std::printf("/%u", soup.uv_corners[i] + 1);
    }
    std::printf("\n");
  }
  for (size_t i = 0; i < soup.crease_sharpness.size(); i++)
    std::printf("t crease 2/1/0 %u %u %g\n", soup.creases[2 * i], soup.creases[2 * i + 1],
                static_cast<double>(soup.crease_sharpness[i]));
  return std::ferror(stdout) != 0;
}

} // namespace

int main(int argc, char **argv) {
  if (argc == 4 && std::strcmp(argv[1], "--peer") == 0) return print_peer(argv[2], argv[3]);
  std::string only;
  const char *json = nullptr;
  std::vector<Case> cases = {{"cube", ball(1, false, false), {6, 8, 9}},
                             {"486 quads", ball(9, false, true), {4, 5}},
                             {"31,104 quads", ball(72, false, true), {3, 4}},
                             {"69,312 triangles", ball(76, true, true), {1, 2, 3}},
                             {"69,312 triangles, Loop", ball(76, true, true), {2, 3}, TW_LOOP},
                             {"isosurface", isosurface(72), {1, 2, 3}},
                             {"large isosurface", isosurface(149), {1, 2, 3}},
                             {"isosurface, Loop", isosurface(72), {1, 2, 3}, TW_LOOP},
                             {"character", unskinned(character(26)), {1, 2, 3, 5}},
                             {"skinned character", character(26), {1, 2, 3}}};
  for (int i = 1; i < argc; i++) {
    if (std::strncmp(argv[i], "--only=", 7) == 0)
      only = argv[i] + 7;
    else if (std::strncmp(argv[i], "--json=", 7) == 0)
      json = argv[i] + 7;
    else if (std::strncmp(argv[i], "--print-ball=", 13) == 0)
      return print_obj(ball(std::atoi(argv[i] + 13), false, false));
    else if (std::strncmp(argv[i], "--print-isosurface=", 19) == 0)
      return print_obj(isosurface(std::atoi(argv[i] + 19)));
    else if (std::strncmp(argv[i], "--print-character=", 18) == 0)
      return print_obj(character(std::atoi(argv[i] + 18)));
    else
      cases.push_back(
          {std::filesystem::path(argv[i]).stem(), read_obj(argv[i]), {1, 2, 3}, TW_CATMULL_CLARK});
  }
  cases.erase(std::remove_if(cases.begin(), cases.end(),
                             [&](const Case &c) { return c.name.find(only) == std::string::npos; }),
              cases.end());
  Report report(json);
  compare_soups(report, cases);
  compare_normals(report, cases);
  compare_moves(report, cases);
  return 0;
}
