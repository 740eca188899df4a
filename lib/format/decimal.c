/* Printing floats: the kernels for every machine, and the choice of the best ones. */
#include "decimal_kernel.h"
#include "processor.h"

static const tw_decimal_kernels anywhere = {find_decimals, print_row, print_vectors};

/* Few machines have AVX-512 and not this: they print with AVX2. */
enum { VBMI2 = TW_SET_AVX2 + 1, SETS };

static const tw_decimal_kernels *const kernels[SETS] = {&anywhere,
#ifdef __x86_64__
                                                        &tw_decimal_kernels_avx2, &tw_decimal_kernels_vbmi2
#endif
};

static bool has(uint32_t set) {
  return set == VBMI2 ? tw_processor_has_vbmi2() : set < VBMI2 && tw_processor_has(set);
}

const tw_decimal_kernels *tw_decimal_kernels_at(uint32_t instruction_set) {
  return has(instruction_set) ? kernels[instruction_set] : NULL;
}

static const tw_decimal_kernels *best(void) {
  uint32_t set = VBMI2;
  while (!has(set)) set--;
  return kernels[set];
}

size_t tw_print_float(char *out, float value) {
  tw_decimals batch;
  batch.values[0] = value;
  find_few(&batch, 1);
  return (size_t)(place(out, &batch, 0) - out) - 1;
}

size_t tw_print_floats(char *out, const float *values, size_t count) {
  char *end = best()->print_row(out, values, count);
  return (size_t)(end - out) - (count > 0 ? 1 : 0);
}

/* Of no numbers, or of more than a batch. */
static char *print_wide(char *out, const tw_vectors *all) {
  char *start = out;
  for (size_t i = 0; i < all->count; i++) {
    *out++ = '[';
    out += tw_print_floats(out, all->values + i * all->stride, all->width);
    *out++ = ']';
    *out++ = ',';
    if (all->ends) all->ends[i] = (size_t)(out - start) - 1;
  }
  return out;
}

size_t tw_print_vectors(char *out, const tw_vectors *vectors) {
  bool fits = vectors->width > 0 && vectors->width <= TW_DECIMALS;
  char *end = fits ? best()->print_vectors(out, vectors) : print_wide(out, vectors);
  return (size_t)(end - out) - (vectors->count > 0 ? 1 : 0);
}
