/* The model that benchmarks upload. */
#ifndef BENCH_MODEL_H
#define BENCH_MODEL_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A model as tweend JSON: a tree of joints, each with irregular rotation keys over ten seconds. malloc'ed. */
char *bench_model(int joints, int keys, size_t *size);

#ifdef __cplusplus
}
#endif
#endif
