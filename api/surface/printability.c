/* Edges are counted as the answer has them, volumes and areas are those of its triangles. */
#include "printability.h"

#include "service.h"

#include <math.h>
#include <string.h>

enum { LISTED_MAX = 256, LIGHT_FACES = 4096 };

bool api_shells_are_light(const api_plan *plan) {
  return api_plan_knows_shells(plan) || plan->total.faces <= LIGHT_FACES;
}

/* ---- warnings -------------------------------------------------------------------------------- */

/* Adds "2 open edges" to a list. */
static void list(tw_text *text, uint64_t count, const char *one, const char *many) {
  if (count == 0) return;
  if (text->size > 0) tw_text_add(text, ", ");
  tw_text_count(text, count);
  tw_text_add(text, count > 1 ? many : one);
}

static void add_times(uint64_t *sum, uint64_t count, uint64_t times) {
  uint64_t most = UINT64_MAX - *sum;
  *sum = times > 0 && count > most / times ? UINT64_MAX : *sum + count * times;
}

/* Adds up the shells of the nodes, and instances of nodes, that show meshes. solids: [meshes]. */
static tw_solid sum_nodes(const tw_model *model, const tw_solid *solids) {
  tw_solid all = {0};
  for (uint32_t n = 0; n < model->node_count; n++) {
    const tw_node *node = &model->nodes[n];
    uint64_t times = tw_node_times_shown(model, n);
    if (times == 0) continue;
    const tw_solid *own = &solids[node->mesh];
    add_times(&all.shells, own->shells, times);
    add_times(&all.closed, own->closed, times);
    add_times(&all.inverted, own->inverted, times);
    add_times(&all.open_edges, own->open_edges, times);
    add_times(&all.crowded_edges, own->crowded_edges, times);
    add_times(&all.flipped_edges, own->flipped_edges, times);
  }
  return all;
}

api_outcome api_warn_of_shells(api_call *call, api_surface_request *request) {
  api_plan *plan = api_entry_value(request->plan);
  if (call->is_head && !api_shells_are_light(plan)) {
    call->leaves_warnings = true;
    return API_DONE;
  }
  tw_solid *solids = tw_arena_alloc(call->arena, plan->count, sizeof *solids);
  if (!solids) return api_fail_without_memory(call);
  if (api_plan_shells(plan, &call->service->parallel, solids, &call->fault.error) != TW_OK)
    return api_fail(call);
  request->solids = solids;
  const tw_solid all = sum_nodes(request->scene.content.model, solids);
  tw_text text = {0};
  list(&text, all.shells - all.closed, " shell is not closed", " shells are not closed");
  list(&text, all.inverted, " shell is inside out, or bounds a cavity",
       " shells are inside out, or bound cavities");
  list(&text, all.open_edges, " open edge", " open edges");
  list(&text, all.crowded_edges, " edge has more than two faces", " edges have more than two faces");
  list(&text, all.flipped_edges, " edge is of two faces of opposite sides",
       " edges are of two faces of opposite sides");
  if (text.size == 0) return API_DONE;
  if (all.closed < all.shells && strcmp(call->offer->extension, "3mf") == 0)
    tw_text_add(&text,
                ": objects of type surface, for which PrusaSlicer refuses the whole file; .stl serves");
  return api_call_warn_text(call, &text);
}

/* ---- surface.json ---------------------------------------------------------------------------- */

static void print_number(tw_text *text, const char *name, double value) {
  tw_text_member(text, name);
  tw_text_double(text, value);
}

static void print_edges(tw_text *text, uint64_t open, uint64_t crowded, uint64_t flipped) {
  tw_member_count(text, "open_edges", open);
  tw_member_count(text, "crowded_edges", crowded);
  tw_member_count(text, "flipped_edges", flipped);
}

tw_status api_print_solid(api_call *call, const api_surface_request *request, tw_text *text) {
  tw_solid solid;
  tw_status status = tw_scene_measure(&request->scene.content, api_flat_scale(&request->query.flat),
                                      &call->service->parallel, &solid, &call->fault.error);
  if (status != TW_OK) return status;
  tw_member_open(text, "solid", "{");
  tw_member_string(text, "unit", request->query.flat.unit->name);
  tw_member_count(text, "shells", solid.shells);
  tw_member_count(text, "closed", solid.closed);
  tw_member_count(text, "inverted", solid.inverted);
  tw_member_count(text, "triangles", solid.triangles);
  print_edges(text, solid.open_edges, solid.crowded_edges, solid.flipped_edges);
  print_number(text, "area", solid.area);
  print_number(text, "volume", solid.volume);
  tw_text_add(text, "}");
  return TW_OK;
}

tw_status api_print_shells(api_call *call, const api_surface_request *request, uint32_t mesh, tw_text *text) {
  const api_plan *plan = api_plan_of(request);
  double scale = api_flat_scale(&request->query.flat);
  tw_shell *shells;
  uint32_t count;
  tw_status status =
      tw_shells_measure(plan->surfaces[mesh], &call->service->parallel, &shells, &count, &call->fault.error);
  if (status != TW_OK) return status;
  tw_member_count(text, "shell_count", count);
  tw_member_open(text, "shells", "[");
  for (uint32_t i = 0; i < count && i < LISTED_MAX; i++) {
    const tw_shell *shell = &shells[i];
    tw_text_element(text);
    tw_text_add(text, "{");
    tw_text_member(text, "closed");
    tw_text_flag(text, shell->is_closed);
    tw_text_member(text, "inverted");
    tw_text_flag(text, shell->volume < 0);
    tw_member_count(text, "faces", shell->faces);
    tw_member_count(text, "triangles", shell->triangles);
    print_edges(text, shell->open_edges, shell->crowded_edges, shell->flipped_edges);
    print_number(text, "area", shell->area * scale * scale);
    print_number(text, "volume", shell->is_closed ? shell->volume * scale * scale * scale : NAN);
    tw_text_add(text, "}");
  }
  tw_text_add(text, "]");
  tw_free(shells);
  return TW_OK;
}
