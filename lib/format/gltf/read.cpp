// glTF 2.0 and GLB to models: checks, tinygltf, then all that tinygltf does not check.
#include "gltf/document.hpp"
#include "gltf/reserve.hpp"
#include "gltf/vertex_values.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

#include "tweend/base.h"

namespace gltf {

namespace {

// How many corners and key values a file may make read: many elements may name one accessor, so a small file
// could ask for any number. Exporters' files have far less than one corner and one key value a byte, and name
// an accessor a few times. The first so many are free whatever the file's size.
constexpr uint64_t corners_free = 4u << 20, corners_max = 64u << 20, corners_per_byte = 2;
constexpr uint64_t values_free = 4u << 20, values_per_byte = 4;

void check_version(const tinygltf::Asset &asset) {
  if (asset.version.compare(0, 2, "2.") != 0)
    refuse(TW_UNSUPPORTED, "/asset/version", "glTF version ", asset.version, ": only version 2 can be read");
  if (!asset.minVersion.empty() && asset.minVersion != "2.0")
    refuse(TW_UNSUPPORTED, "/asset/minVersion", "the document needs glTF ", asset.minVersion);
}

// The first line of the parser's message, if it can be shown.
std::string parser_message(const std::string &message) {
  std::string line = message.substr(0, std::min<size_t>(message.find('\n'), 200));
  if (line.empty() || !tw_utf8_is_name(line.data(), line.size())) return "the document is not valid glTF";
  return "the document is not valid glTF: " + line;
}

// The parser's destructors move the children of an array or object into a list, whose entries are a fraction
// of what the tree takes.
constexpr uint64_t reserve_least = 64u << 10, reserve_part = 16;

void parse(Document &document) {
  Outline &outline = document.outline;
  tinygltf::TinyGLTF parser;
  parser.SetFsCallbacks(tinygltf::FsCallbacks{}); // no file system
  std::string errors, warnings;
  document.budget.take(outline.model_size);
  Hold tree(document.budget, outline.tree_size);
  if (!Reserve::of_thread()->fill(reserve_least + outline.tree_size / reserve_part)) throw std::bad_alloc();
  bool parsed = parser.LoadASCIIFromString(&document.source, &errors, &warnings, outline.json.data(),
                                           static_cast<unsigned>(outline.json.size()), "");
  if (!parsed) refuse(TW_INVALID, "", parser_message(errors));
  for (const DecodedView &decoded : outline.decoded_views) {
    tinygltf::BufferView &view = document.source.bufferViews.at(decoded.view);
    view.buffer = static_cast<int>(decoded.buffer);
    view.byteOffset = 0;
    view.byteLength = outline.buffers[decoded.buffer].size;
  }
  outline.json.clear();
  outline.json.shrink_to_fit();
}

void tell_misfits(const std::vector<Misfit> &misfits, tw_model *model) {
  for (const Misfit &kind : misfits)
    tw_model_warn(model, "%s: %s%s", printable(kind.place).c_str(), kind.what,
                  kind.count == 1 ? ""
                                  : text(", as at ", kind.count - 1, " more ",
                                         tw_plural(kind.count - 1, "place", "places"))
                                        .c_str());
}

// Gives primitives of triangles that have no morph targets those that others of their mesh have, without
// attributes: they stay where they are. Beside points and lines, which pass through as they are, and where
// primitives have other numbers of targets, the mesh is refused when it is read.
void fill_targets(Document &document) {
  size_t filled = 0;
  for (size_t m = 0; m < document.source.meshes.size(); m++) {
    std::vector<tinygltf::Primitive> &primitives = document.source.meshes[m].primitives;
    size_t most = 0;
    bool are_triangles = true;
    for (const tinygltf::Primitive &primitive : primitives) {
      most = std::max(most, primitive.targets.size());
      are_triangles &= primitive.mode >= TINYGLTF_MODE_TRIANGLES || primitive.mode < 0;
    }
    if (!are_triangles || most == 0) continue;
    for (tinygltf::Primitive &primitive : primitives) {
      if (!primitive.targets.empty()) continue;
      check_morph_count(most, m);
      document.budget.place = text("/meshes/", m);
      document.budget.take(most * sizeof primitive.targets[0]);
      primitive.targets.resize(most);
      filled++;
    }
  }
  document.outline.lose(
      "primitive has no morph targets beside others of its mesh: they do not move it",
      "primitives have no morph targets beside others of their meshes: they do not move them", filled);
}

void read(const Bytes &file, Document &document) {
  make_outline(file, document);
  parse(document);
  fill_targets(document);
  check_version(document.source.asset);
  document.corners_left = std::min(corners_free + corners_per_byte * file.size, corners_max);
  document.values_left = values_free + values_per_byte * file.size;
  document.model->format = document.outline.binary ? TW_FORMAT_GLB : TW_FORMAT_GLTF;

  Accessors accessors(document.source, document.outline.buffers, document.budget);
  keep_parts(document, accessors);
  read_assets(document);
  read_meshes(document, accessors);
  read_nodes(document);
  read_humanoid(document);
  read_face(document);
  read_skins(document, accessors);
  read_clips(document, accessors);
  tw_losses_tell(&document.outline.losses, document.model);
  tell_misfits(document.outline.misfits, document.model);
}

tw_status read_or_report(const Bytes &file, Document &document, tw_error *error) {
  try {
    read(file, document);
  } catch (const Refusal &refusal) {
    // The parser catches bad_alloc itself, and calls the document invalid.
    if (Reserve::of_thread()->has_failed()) throw std::bad_alloc();
    return report(refusal, error);
  } catch (const std::bad_alloc &) {
    throw;
  } catch (const std::exception &exception) {
    return report({TW_INVALID, "", parser_message(exception.what())}, error);
  }
  return TW_OK;
}

// Finishes the model, and turns the place of an error, which is one of tweend JSON, into the document's: a
// key lies in an accessor, all else of a track in its channel. Geometry is the mesh's.
tw_status finish(const TrackPlaces &places, tw_model *model, tw_error *error) {
  tw_error own = {};
  tw_status status = tw_model_finish(model, &own);
  unsigned clip = 0, track = 0, mesh = 0;
  char member[16] = "";
  if (status == TW_OK || !error) return status;
  *error = own;
  // NOLINTBEGIN(cert-err34-c): tweend's own pointers, whose numbers fit
  int found = std::sscanf(own.pointer, "/clips/%u/tracks/%u/%15[a-z_]", &clip, &track, member);
  if (found >= 2 && clip < places.size() && track < places[clip].size()) {
    const TrackPlace &place = places[clip][track];
    std::string_view part = member;
    if (part == "times")
      tw_error_at(error, "/accessors/%d", place.input);
    else if (part == "values" || part == "quaternions")
      tw_error_at(error, "/accessors/%d", place.output);
    else
      tw_error_at(error, "/animations/%u/channels/%u%s%s", clip, place.channel,
                  part == "path" || part == "node" ? "/target/" : "",
                  part == "path" || part == "node" ? member : "");
  } else if (std::sscanf(own.pointer, "/clips/%u", &clip) == 1) {
    tw_error_at(error, "/animations/%u%s", clip,
                std::strchr(own.pointer + 7, '/') ? std::strchr(own.pointer + 7, '/') : "");
  } else if (std::sscanf(own.pointer, "/meshes/%u", &mesh) == 1) {
    tw_error_at(error, "/meshes/%u", mesh);
  }
  // NOLINTEND(cert-err34-c)
  return status;
}

// All exceptions end here.
tw_status read_model(const Bytes &file, uint64_t json_values, tw_quads quads, tw_weld weld, tw_model *model,
                     tw_error *error) {
  tw_status status = TW_OK;
  Reserve reserve; // outlives the document
  try {
    auto document =
        std::make_unique<Document>(model, quads, weld, tw_reading_size(TW_FORMAT_GLB, file.size) - file.size);
    document->json_values = json_values;
    status = read_or_report(file, *document, error);
    TrackPlaces places = std::move(document->track_places);
    document.reset();
    if (status == TW_OK) status = finish(places, model, error);
  } catch (const std::bad_alloc &) {
    return tw_fail(error, TW_NO_MEMORY, "out of memory");
  } catch (...) {
    return tw_fail(error, TW_INVALID, "the document is not valid glTF");
  }
  return status;
}

} // namespace

tw_status report(const Refusal &refusal, tw_error *error) {
  tw_fail(error, refusal.status, "%s", printable(refusal.detail).c_str());
  if (!refusal.pointer.empty()) tw_error_at(error, "%s", printable(refusal.pointer).c_str());
  return refusal.status;
}

} // namespace gltf

tw_status tw_gltf_read(const uint8_t *bytes, size_t size, tw_quads quads, tw_weld weld, uint64_t json_values,
                       tw_model **out, tw_error *error) {
  tw_model *model = tw_model_create();
  if (!model) return tw_fail(error, TW_NO_MEMORY, "out of memory");
  tw_status status = gltf::read_model({bytes, size}, json_values, quads, weld, model, error);
  if (status == TW_OK)
    *out = model;
  else
    tw_model_destroy(model);
  return status;
}
