/* STL and PLY know no unit; printers take STL's numbers for millimetres. 3MF tells its unit. */
#include "flat_answer.h"

#include <string.h>

static const api_length_unit units[] = {{"mm", "millimetres", "millimeter", 1000},
                                        {"cm", "centimetres", "centimeter", 100},
                                        {"m", "metres", "meter", 1},
                                        {"um", "micrometres", "micron", 1e6},
                                        {"in", "inches", "inch", 1 / 0.0254},
                                        {"ft", "feet", "foot", 1 / 0.3048}};
static const char *const unit_names[] = {"mm", "cm", "m", "um", "in", "ft", NULL};

api_outcome api_flat_read(api_call *call, const char *fallback, api_flat_query *out) {
  const api_query *query = &call->query;
  tw_error *error = &call->fault.error;
  const char *named[] = {"unit", "scale"};
  int unit = 0;
  for (size_t i = 0; !fallback && i < sizeof named / sizeof *named; i++)
    if (api_query_get(query, named[i]))
      return api_fail_with(
          call, 400, "%s goes with .stl, .ply, .3mf and .json: the lengths of this form are the model's",
          named[i]);
  while (fallback && strcmp(units[unit].name, fallback) != 0) unit++;
  *out = (api_flat_query){.is_unit_given = api_query_get(query, "unit"), .scale = 1};
  tw_status status = api_query_choice(query, "unit", unit_names, &unit, error);
  if (status == TW_OK) status = api_query_number(query, "scale", &out->scale, error);
  if (status == TW_OK && !(out->scale >= 1e-9 && out->scale <= 1e9))
    status = tw_fail(error, TW_SYNTAX, "scale must be from 1e-9 to 1e9");
  out->unit = fallback ? &units[unit] : NULL;
  return api_outcome_of(call, status);
}

/* Whether the answer tells of a unit that was not asked for. */
static bool tells_of_unit(const api_flat_query *query) {
  return !query->is_unit_given && query->unit->scale != 1;
}

void api_flat_print(const api_flat_query *query, tw_text *text) {
  if (!query->unit) return;
  tw_text_add(text, "&unit=");
  tw_text_add(text, query->unit->name);
  tw_text_add(text, tells_of_unit(query) ? "?" : "");
  tw_text_add(text, "&scale=");
  tw_text_double(text, query->scale);
}

double api_flat_scale(const api_flat_query *query) {
  return query->scale * query->unit->scale;
}

api_outcome api_flat_warn_of_unit(api_call *call, const api_flat_query *query) {
  if (!tells_of_unit(query)) return API_DONE;
  tw_text text = {0};
  tw_text_add(&text, "the model's metres became ");
  tw_text_add(&text, query->unit->word);
  tw_text_add(&text, ": unit=m keeps them, scale= fits a model of another unit");
  return api_call_warn_text(call, &text);
}

api_outcome api_flat_warn_of_move(api_call *call, const double origin[3]) {
  tw_text text = {0};
  tw_text_add(&text, "all is moved by ");
  for (int c = 0; c < 3; c++) {
    tw_text_add(&text, c > 0 ? ", " : "");
    tw_text_double(&text, -origin[c]);
  }
  tw_text_add(&text, " of the model: floats so far from the origin would change its shape");
  return api_call_warn_text(call, &text);
}

api_outcome api_flat_warn_of_far(api_call *call, uint32_t count) {
  tw_text text = {0};
  if (count == 0) return API_DONE;
  tw_text_count(&text, count);
  tw_text_add(&text, count == 1 ? " mesh lies so far from the others that floats change its shape"
                                : " meshes lie so far from the others that floats change their shape");
  return api_call_warn_text(call, &text);
}

/* ---- losses ---------------------------------------------------------------------------------- */

/* How many meshes, nodes or materials have something. */
typedef struct flat_losses {
  uint64_t instances, shown;
  uint32_t materials, textures, moved_textures, colors, corner_colors, attributes, uvs, more_uvs, seams,
      loose, hard;
} flat_losses;

/* Whether the surface has more than one normal at some point: its rows are split, and it has infinitely sharp
 * edges or the file's own normals. Where it has no values of corners, nothing else splits rows. */
static bool has_hard_normals(const tw_mesh *mesh, const tw_surface *surface, bool is_hard) {
  const tw_surface_options *options = tw_surface_get_options(surface);
  tw_channel channels[TW_CHANNELS_MAX];
  bool is_split =
      tw_surface_row_count(surface, TW_DOMAIN_VERTICES) > tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  if (tw_surface_get_layout(surface)->normal == UINT32_MAX || !is_split) return false;
  if (tw_mesh_channels(mesh, channels) == 0 || is_hard || options->scheme == TW_BILINEAR) return true;
  if (options->own_normals && mesh->normals.corners) return true;
  for (uint32_t i = 0; i < mesh->crease_count; i++)
    if (mesh->crease_sharpness[i] >= TW_SHARPNESS_INFINITE) return true;
  return false;
}

static void count_mesh(const tw_mesh *mesh, const tw_surface *surface, bool is_hard, flat_losses *losses) {
  bool has_colors = false, has_corner_colors = false, has_attributes = false;
  for (uint32_t k = 0; k < mesh->attribute_count; k++) {
    has_colors |= mesh->attributes[k].is_color;
    has_corner_colors |= mesh->attributes[k].is_color && mesh->attributes[k].corners;
    has_attributes |= !mesh->attributes[k].is_color;
  }
  losses->colors += has_colors;
  losses->corner_colors += has_corner_colors;
  losses->attributes += has_attributes;
  losses->uvs += mesh->uv_set_count > 0;
  losses->seams +=
      tw_surface_row_count(surface, TW_DOMAIN_UVS) > tw_surface_row_count(surface, TW_DOMAIN_POINTS);
  losses->more_uvs += mesh->uv_set_count > 1;
  losses->loose += mesh->loose != NULL;
  losses->hard += has_hard_normals(mesh, surface, is_hard);
}

static flat_losses count_losses(const tw_scene *scene, bool is_hard) {
  const tw_model *model = scene->model;
  flat_losses losses = {.materials = model->material_colors ? model->material_count : 0};
  losses.textures = model->assets ? model->material_count : 0;
  losses.moved_textures = tw_gltf_moved_textures(model->assets);
  for (uint32_t i = 0; i < model->mesh_count; i++)
    count_mesh(&model->meshes[i], scene->surfaces[i], is_hard, &losses);
  for (uint32_t n = 0; n < model->node_count; n++) {
    losses.shown += tw_node_times_shown(model, n);
    losses.instances += tw_node_lost_instances(model, n);
  }
  return losses;
}

api_outcome api_flat_warn_of_losses(api_call *call, const tw_scene *scene, uint32_t lacks, bool is_hard) {
  const flat_losses losses = count_losses(scene, is_hard);
  const struct {
    uint32_t lack;
    bool is_there;
    const char *what;
  } rows[] = {{API_LACKS_SCENE, losses.instances > 0, "instances of EXT_mesh_gpu_instancing"},
              {API_LACKS_NODES, losses.shown > 1, "the nodes, which are one mesh"},
              {API_LACKS_MATERIALS, losses.materials + losses.textures > 0, "materials"},
              {API_LACKS_TEXTURES, losses.textures > 0, "all of materials but their base colours"},
              {API_LACKS_UVS, losses.uvs > 0, "texture coordinates"},
              {API_LACKS_TRANSFORMS, losses.uvs > 0 && losses.moved_textures > 0,
               "the transforms of texture coordinates (KHR_texture_transform)"},
              {API_LACKS_MORE_UVS, losses.more_uvs > 0, "texture coordinates behind the first set"},
              {API_LACKS_COLORS, losses.colors > 0, "colours of points"},
              {API_LACKS_CORNER_COLORS, losses.corner_colors > 0, "all but one colour of a point"},
              {API_LACKS_CORNER_NORMALS, losses.hard > 0, "all but one normal of a point"},
              {API_LACKS_CORNER_UVS, losses.seams > 0, "all but one texture coordinate of a point"},
              {API_LACKS_SCENE, losses.attributes > 0, "attributes of the application"},
              {API_LACKS_SCENE, losses.loose > 0, "points and lines"}};
  tw_text text = {0};
  tw_text_add(&text, "surface.");
  tw_text_add(&text, call->offer->extension);
  tw_text_add(&text, " is without");
  size_t begin = text.size;
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    if (!(rows[i].lack & lacks) || !rows[i].is_there) continue;
    tw_text_add(&text, text.size > begin ? ", " : ": ");
    tw_text_add(&text, rows[i].what);
  }
  if (text.size > begin || text.failed) return api_call_warn_text(call, &text);
  tw_text_deinit(&text);
  return API_DONE;
}
