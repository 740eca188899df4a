/* Files embedded by the build. */
#ifndef API_FILES_H
#define API_FILES_H

#include <stddef.h>

typedef struct api_file {
  const unsigned char *bytes;
  size_t size;
  const char *hash; /* SHA-256 in hex */
} api_file;

extern const api_file api_openapi;      /* api/openapi.json */
extern const api_file api_client;       /* api/client/tweend.js */
extern const api_file api_client_types; /* api/client/tweend.d.ts */

#endif
