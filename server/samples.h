/* The sample models of server/samples, embedded in the binary by the build. */
#ifndef SRV_SAMPLES_H
#define SRV_SAMPLES_H

#include <stddef.h>

typedef struct srv_sample {
  const char *name; /* file name */
  const unsigned char *bytes;
  size_t size;
} srv_sample;

extern const srv_sample srv_samples[];
extern const size_t srv_sample_count;

#endif
