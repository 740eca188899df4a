/* The credentials that sign requests to an S3 store. */
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

/* The value of an environment variable, "" without one. */
const char *srv_s3_variable(const char *name);

/* Reads credentials from `file`, which has the format of ~/.aws/credentials. With file "": from
 * AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN in the environment, else from the file that
 * AWS_SHARED_CREDENTIALS_FILE names, else from ~/.aws/credentials. In a file, the section that AWS_PROFILE
 * names ("default" without it) counts, and the lines before all sections. False with one line in error. Any
 * thread. */
bool srv_s3_credentials_read(const char *file, srv_s3_credentials *out, srv_error *error);

#endif
