/* Buffer views and accessors of a planned glTF answer. */
#include "gltf/gltf.h"

/* The most views, accessors, nodes and materials together: the JSON that lists them is held in memory. */
static const uint64_t PARTS_MAX = 1 << 18;

/* Makes room for one more row behind `count` rows, which grow by doubling, and counts it. Returns the rows,
 * which may have moved. NULL over the limit and without memory: planning goes on with the rows that there
 * are, and tw_gltf_check_parts fails at the end. */
static void *make_room(tw_gltf_plan *plan, void *rows, uint32_t count, size_t size) {
  bool is_full = count == 0 || (count >= 64 && (count & (count - 1)) == 0);
  if (++plan->part_count > PARTS_MAX || plan->lacks_memory) return NULL;
  void *grown = is_full ? tw_resize(rows, (count ? 2 * (size_t)count : 64) * size) : rows;
  plan->lacks_memory = grown == NULL;
  return grown;
}

uint32_t tw_gltf_add_view(tw_gltf_plan *plan, tw_gltf_view view) {
  tw_gltf_view *views = make_room(plan, plan->views, plan->view_count, sizeof *views);
  if (!views) return 0;
  view.offset = plan->data_size;
  plan->data_size = (view.offset + view.size + 3) / 4 * 4;
  plan->views = views;
  plan->views[plan->view_count] = view;
  return plan->view_count++;
}

uint32_t tw_gltf_add_accessor(tw_gltf_plan *plan, tw_gltf_accessor accessor) {
  tw_gltf_accessor *accessors = make_room(plan, plan->accessors, plan->accessor_count, sizeof *accessors);
  if (!accessors) return 0;
  plan->accessors = accessors;
  plan->accessors[plan->accessor_count] = accessor;
  return plan->accessor_count++;
}

const char *tw_gltf_type_of(int width) {
  static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  return width == 16 ? "MAT4" : names[width - 1];
}

uint32_t tw_gltf_add_memory(tw_gltf_plan *plan, const void *memory, uint64_t size) {
  return tw_gltf_add_view(
      plan, (tw_gltf_view){.size = size, .element_size = 1, .source = TW_GLTF_MEMORY, .memory = memory});
}

uint32_t tw_gltf_add_numbers(tw_gltf_plan *plan, const void *values, uint64_t count, int component,
                             int width) {
  uint32_t view = tw_gltf_add_memory(plan, values, count * (uint64_t)width * 4);
  return tw_gltf_add_accessor(
      plan, (tw_gltf_accessor){
                .view = view, .component = component, .type = tw_gltf_type_of(width), .count = count});
}

uint32_t tw_gltf_add_floats(tw_gltf_plan *plan, const float *values, uint64_t count, int width) {
  return tw_gltf_add_numbers(plan, values, count, TW_GLTF_FLOAT, width);
}

tw_status tw_gltf_check_parts(const tw_gltf_plan *plan, tw_error *error) {
  if (plan->part_count > PARTS_MAX)
    return tw_fail(error, TW_LIMIT,
                   "as glTF the answer would have %llu nodes, materials, accessors and buffer views, over "
                   "the limit of %llu",
                   (unsigned long long)plan->part_count, (unsigned long long)PARTS_MAX);
  return plan->lacks_memory ? tw_gltf_no_memory(error) : TW_OK;
}
