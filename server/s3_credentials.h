/* Who signs requests to an S3 store. */
#ifndef SRV_S3_CREDENTIALS_H
#define SRV_S3_CREDENTIALS_H

#include "fail.h"

#include <stdbool.h>
#include <stddef.h>

enum { SRV_S3_KEY_SIZE = 256, SRV_S3_TOKEN_SIZE = 4096 };

typedef struct srv_s3_credentials {
  char key[SRV_S3_KEY_SIZE], secret[SRV_S3_KEY_SIZE];
  char token[SRV_S3_TOKEN_SIZE]; /* of a session, "" without one */
} srv_s3_credentials;

/* Reads them from the file that is named, of the form of ~/.aws/credentials; with file "" from the
 * AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN of the environment, else from the file that
 * AWS_SHARED_CREDENTIALS_FILE names, else from ~/.aws/credentials. Of a file the section that AWS_PROFILE
 * names counts, "default" without it, and what stands before all sections. False with one line in error. Any
 * thread. */
bool srv_s3_credentials_read(const char *file, srv_s3_credentials *out, srv_error *error);

#endif
