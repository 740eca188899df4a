/* What models and surfaces say they hold, which the cache goes by, against what they have allocated. Linked
 * with malloc, calloc, realloc and free wrapped. */
#include <stdlib.h>

#include "scene_fixture.h"
#include "test.h"
#include "wrapped_memory.h"

/* To a tenth, and some words that an allocation may be rounded up by. */
static void assert_told(size_t told, size_t before) {
  size_t really = test_memory.held - before;
  if (told + 512 < really - really / 10 || told > really + really / 10 + 512)
    fail_msg("%zu bytes are held, not %zu", really, told);
}

TEST(models_tell_what_they_hold) {
  static const char *const texts[] = {cube_text, patchwork_text};
  for (int i = 0; i < 2; i++) {
    fixture f;
    size_t before = test_memory.held;
    fixture_init(&f, texts[i]);
    assert_told(tw_model_size(f.model), before);
    fixture_deinit(&f);
    assert_int_equal(test_memory.held, before);
  }
}

static void check_surfaces(const tw_mesh *mesh, tw_scheme scheme) {
  for (uint32_t level = 0; level < 5; level++)
    for (int movable = 0; movable < 2; movable++) {
      const tw_surface_options options = {
          .level = level, .scheme = scheme, .normals = true, .movable = movable};
      tw_surface *surface, *moved;
      size_t before = test_memory.held;
      assert_int_equal(tw_surface_create(mesh, &options, &surface, NULL), TW_OK);
      assert_told(tw_surface_size(surface), before);
      if (movable) {
        size_t still = test_memory.held;
        assert_int_equal(tw_surface_with_positions_by(surface, mesh->positions, NULL, &moved), TW_OK);
        assert_told(tw_surface_size(moved), still);
        tw_surface_destroy(moved);
      }
      tw_surface_destroy(surface);
      assert_int_equal(test_memory.held, before);
    }
}

TEST(surfaces_tell_what_they_hold) {
  static const char *const texts[] = {cube_text, patchwork_text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"};
  for (int i = 0; i < 2; i++) { /* with these the tables are made that all surfaces share */
    fixture first;
    fixture_init(&first, texts[i]);
    fixture_refine(&first, 4, true);
    fixture_deinit(&first);
  }
  for (int i = 0; i < 3; i++) {
    fixture f;
    fixture_init(&f, texts[i]);
    if (i == 1) {
      f.model->meshes[0].has_tangents = true;
      fixture_add_morphs(&f, 2);
      fixture_add_colors(&f);
      fixture_add_skin(&f);
    }
    check_surfaces(&f.model->meshes[0], i == 2 ? TW_LOOP : TW_CATMULL_CLARK);
    fixture_deinit(&f);
  }
}
