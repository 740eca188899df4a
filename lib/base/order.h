/* Orders for qsort. */
#ifndef TWEEND_ORDER_H
#define TWEEND_ORDER_H

static inline int tw_order_floats(const void *a, const void *b) {
  float left = *(const float *)a, right = *(const float *)b;
  return (left > right) - (left < right);
}

static inline int tw_order_doubles(const void *a, const void *b) {
  double left = *(const double *)a, right = *(const double *)b;
  return (left > right) - (left < right);
}

#endif
