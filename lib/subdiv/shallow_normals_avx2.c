/* Rows of shallow surfaces with normals on machines with AVX2: compiled for it. */
#include "shallow_normals_kernel.h"

void tw_shallow_fill_avx2(const tw_shallow_level *level, const tw_shallow_rows *rows) {
  fill_rows(level, rows);
}
