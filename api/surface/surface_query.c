/* Reads the parameters of surfaces. */
#include "handlers.h"
#include "surface_request.h"

#include <string.h>

/* Reads weld: a word, or a distance. */
static tw_status read_weld(const api_query *query, api_reading *out, tw_error *error) {
  const char *text = api_query_get(query, "weld");
  double distance;
  if (!text || strcmp(text, "auto") == 0) return TW_OK;
  if (strcmp(text, "none") == 0 || strcmp(text, "exact") == 0) {
    out->weld = *text == 'n' ? TW_WELD_NONE : TW_WELD_EXACT;
    return TW_OK;
  }
  if (!api_number_read(text, strlen(text), &distance) || distance < 1e-9 ||
      distance > (double)TW_COORDINATE_MAX)
    return tw_fail(error, TW_SYNTAX, "weld=%.60s: expected auto, exact, none or a distance from 1e-9 to 1e18",
                   text);
  out->weld = TW_WELD_DISTANCE;
  out->distance = distance;
  return TW_OK;
}

/* Reads creases: a word, or angle:DEGREES. */
static tw_status read_creases(const api_query *query, api_surface_query *out, tw_error *error) {
  static const char *const words[] = {"tags", "normals", "angle", "auto", "none", "file", NULL};
  static const char angle[] = "angle:";
  const char *text = api_query_get(query, "creases");
  int creases = TW_CREASES_FILE;
  if (text && strncmp(text, angle, strlen(angle)) == 0) {
    const char *degrees = text + strlen(angle);
    bool is_read = api_number_read(degrees, strlen(degrees), &out->crease_degrees);
    if (!is_read || out->crease_degrees < 0 || out->crease_degrees > 180)
      return tw_fail(error, TW_SYNTAX, "creases=%.60s: angle:DEGREES has a number from 0 to 180", text);
    creases = TW_CREASES_ANGLE;
  } else if (text && strcmp(text, "angle") == 0) {
    return tw_fail(error, TW_SYNTAX, "creases=angle needs degrees, as in creases=angle:30");
  } else {
    tw_status status = api_query_choice(query, "creases", words, &creases, error);
    if (status != TW_OK) return status;
  }
  out->creases = (tw_creases)creases;
  return TW_OK;
}

/* Reads crease_sharpness: a number, or "infinite". */
static tw_status read_crease_sharpness(const api_query *query, api_surface_query *out, tw_error *error) {
  const char *text = api_query_get(query, "crease_sharpness");
  double sharpness = (double)TW_SHARPNESS_INFINITE;
  bool is_number = text && strcmp(text, "infinite") != 0;
  tw_status status = is_number ? api_query_number(query, "crease_sharpness", &sharpness, error) : TW_OK;
  if (status != TW_OK) return status;
  if (sharpness < 0 || sharpness > (double)TW_SHARPNESS_INFINITE)
    return tw_fail(error, TW_SYNTAX, "crease_sharpness must be from 0 to 10, or infinite, which is 10");
  bool is_used = out->creases != TW_CREASES_TAGS && out->creases != TW_CREASES_NONE;
  out->crease_sharpness = is_used ? (float)sharpness : 0;
  return TW_OK;
}

static tw_status read_surface(const api_query *query, api_surface_query *out, tw_error *error) {
  static const char *const uvs[] = {"corners-only", "none", "corners-plus1", "corners-plus2", "boundaries",
                                    "all",          NULL};
  static const char *const creasings[] = {"uniform", "chaikin", NULL};
  static const char *const triangles[] = {"catmull-clark", "smooth", NULL};
  static const char *const normals[] = {"auto", "limit", "none", NULL};
  static const char *const influences[] = {"all", "4", NULL};
  int normal = 0, influence = 0;
  tw_status status = api_surface_query_begin(query, out, error);
  out->level = 1;
  if (status == TW_OK) status = api_query_count(query, "level", &out->level, error);
  if (status == TW_OK) status = api_query_choice(query, "uv", uvs, &out->uv, error);
  if (status == TW_OK) status = api_query_choice(query, "creasing", creasings, &out->creasing, error);
  if (status == TW_OK) status = api_query_choice(query, "triangles", triangles, &out->triangles, error);
  if (status == TW_OK) status = api_quads_read(query, &out->reading.quads, error);
  if (status == TW_OK) status = api_query_choice(query, "normals", normals, &normal, error);
  if (status == TW_OK) status = api_query_flag(query, "limit", &out->limit, error);
  if (status == TW_OK) status = api_query_flag(query, "details", &out->details, error);
  if (status == TW_OK) status = read_weld(query, &out->reading, error);
  if (status == TW_OK) status = read_creases(query, out, error);
  if (status == TW_OK) status = read_crease_sharpness(query, out, error);
  if (status == TW_OK) status = api_query_choice(query, "influences", influences, &influence, error);
  out->influences = influence == 1 ? 4 : 0;
  out->normals = normal != 2;
  out->own_normals = normal == 0 && out->level == 0 && !out->limit;
  return status;
}

api_surface_request *api_surface_request_read(api_call *call) {
  static const char *const encodings[] = {"float", "quantized", "meshopt", NULL};
  static const char *const polygons[] = {"triangles", "ngon", NULL};
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  api_surface_request *request = tw_arena_alloc(call->arena, 1, sizeof *request);
  if (!request) {
    api_fail_without_memory(call);
    return NULL;
  }
  int encoding = 0, polygon = 0;
  tw_status status = read_surface(query, &request->surface, error);
  if (status == TW_OK) status = api_query_choice(query, "encoding", encodings, &encoding, error);
  if (status == TW_OK) status = api_query_choice(query, "polygons", polygons, &polygon, error);
  if (status == TW_OK) status = api_query_flag(query, "shells", &request->with_shells, error);
  if (status != TW_OK) {
    api_fail(call);
    return NULL;
  }
  request->form = (api_surface_form)(call->offer - call->route->offers);
  /* Level 0 in a form that can express all of a cage reads back as the cage. */
  bool is_obj = request->form == FORM_OBJ, is_of_gltf = api_is_gltf(request) || request->form == FORM_JSON;
  bool is_cage_of_gltf = is_of_gltf && polygon == TW_POLYGONS_NGON && encoding == TW_ENCODING_FLOAT;
  request->surface.tagged =
      (is_obj || is_cage_of_gltf) && request->surface.level == 0 && !request->surface.limit;
  request->surface.with_holes = request->surface.tagged && is_cage_of_gltf;
  static const char *const flat_names[] = {[FORM_OBJ] = "OBJ", [FORM_STL] = "STL", [FORM_PLY] = "PLY"};
  static const char *const flat_units[] = {[FORM_JSON] = "m", [FORM_STL] = "mm", [FORM_PLY] = "m"};
  if (api_scene_read(call, flat_names[request->form], &request->scene.query) != API_DONE) return NULL;
  if (api_flat_read(call, flat_units[request->form], &request->flat_query) != API_DONE) return NULL;
  if (request->form != FORM_JSON && request->with_shells) {
    api_fail_with(call, 400, "shells=true goes with .json: it tells of the shells of the other forms");
    return NULL;
  }
  request->polygons = (tw_polygons)polygon;
  request->encoding = is_of_gltf ? (tw_encoding)encoding : TW_ENCODING_FLOAT;
  return request;
}
