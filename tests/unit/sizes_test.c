/* What models and surfaces say they hold, which the cache goes by, against what they have allocated. Linked
 * with malloc, calloc, realloc and free wrapped. */
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "scene_fixture.h"

/* The linker's --wrap gives these names.
 * NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */
void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *memory, size_t size);
void __real_free(void *memory);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *memory, size_t size);
void __wrap_free(void *memory);

static size_t held;

static void *counted(void *memory) {
  held += malloc_usable_size(memory);
  return memory;
}

void *__wrap_malloc(size_t size) {
  return counted(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size) {
  return counted(__real_calloc(count, size));
}

void *__wrap_realloc(void *memory, size_t size) {
  held -= malloc_usable_size(memory);
  return counted(__real_realloc(memory, size));
}

void __wrap_free(void *memory) {
  held -= malloc_usable_size(memory);
  __real_free(memory);
}
/* NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp) */

/* To a tenth, and some words that an allocation may be rounded up by. */
static void assert_told(size_t told, size_t before) {
  size_t really = held - before;
  if (told + 512 < really - really / 10 || told > really + really / 10 + 512)
    fail_msg("%zu bytes are held, not %zu", really, told);
}

static void models_tell_what_they_hold(void **state) {
  (void)state;
  static const char *const texts[] = {cube_text, patchwork_text};
  for (int i = 0; i < 2; i++) {
    fixture f;
    size_t before = held;
    fixture_init(&f, texts[i]);
    assert_told(tw_model_size(f.model), before);
    fixture_deinit(&f);
    assert_int_equal(held, before);
  }
}

static void check_surfaces(const tw_mesh *mesh, tw_scheme scheme) {
  for (uint32_t level = 0; level < 5; level++)
    for (int movable = 0; movable < 2; movable++) {
      const tw_surface_options options = {
          .level = level, .scheme = scheme, .normals = true, .movable = movable};
      tw_surface *surface, *moved;
      size_t before = held;
      assert_int_equal(tw_surface_create(mesh, &options, &surface, NULL), TW_OK);
      assert_told(tw_surface_size(surface), before);
      if (movable) {
        size_t still = held;
        assert_int_equal(tw_surface_with_positions(surface, mesh->positions, &moved), TW_OK);
        assert_told(tw_surface_size(moved), still);
        tw_surface_destroy(moved);
      }
      tw_surface_destroy(surface);
      assert_int_equal(held, before);
    }
}

static void surfaces_tell_what_they_hold(void **state) {
  (void)state;
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

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(models_tell_what_they_hold),
      cmocka_unit_test(surfaces_tell_what_they_hold),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
