/* Reads the file again for each signed request: it is small, and keys are rotated by replacing the file. */
#include "s3_credentials.h"

#include "disk.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FILE_MAX = 64 << 10 };

/* False when the text does not fit. */
static bool copy(const char *text, char *out, size_t out_size) {
  size_t size = strlen(text);
  if (size >= out_size) return false;
  memcpy(out, text, size + 1);
  return true;
}

/* Reads one line "name = value"; false when the value is too long. */
static bool read_assignment(char *line, srv_s3_credentials *out) {
  char *equals = strchr(line, '=');
  if (!equals) return true;
  *equals = '\0';
  const char *name = srv_trim(line), *value = srv_trim(equals + 1);
  if (strcmp(name, "aws_access_key_id") == 0) return copy(value, out->key, sizeof out->key);
  if (strcmp(name, "aws_secret_access_key") == 0) return copy(value, out->secret, sizeof out->secret);
  if (strcmp(name, "aws_session_token") == 0) return copy(value, out->token, sizeof out->token);
  return true;
}

static bool read_profile(char *text, const char *profile, srv_s3_credentials *out) {
  bool is_in = true;
  char *rest = NULL;
  for (char *line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
    line = srv_trim(line);
    size_t size = strlen(line);
    if (line[0] == '#' || line[0] == ';') continue;
    if (line[0] == '[' && line[size - 1] == ']') {
      line[size - 1] = '\0';
      is_in = strcmp(srv_trim(line + 1), profile) == 0;
    } else if (is_in && !read_assignment(line, out)) {
      return false;
    }
  }
  return true;
}

static bool read_file(const char *path, const char *profile, srv_s3_credentials *out, srv_error *error) {
  char *text = srv_read_text(path, FILE_MAX);
  if (!text) return srv_fail(error, "cannot read credentials of '%s': %s", path, strerror(errno));
  size_t size = strlen(text); /* before read_profile cuts the text into pieces */
  bool is_read = read_profile(text, profile, out) && out->key[0] != '\0' && out->secret[0] != '\0';
  explicit_bzero(text, size);
  free(text);
  return is_read ||
         srv_fail(error, "'%s' has no usable aws_access_key_id and aws_secret_access_key for profile '%s'",
                  path, profile);
}

const char *srv_s3_variable(const char *name) {
  const char *text = getenv(name);
  return text ? text : "";
}

bool srv_s3_credentials_read(const char *file, srv_s3_credentials *out, srv_error *error) {
  const char *key = srv_s3_variable("AWS_ACCESS_KEY_ID");
  const char *profile = srv_s3_variable("AWS_PROFILE");
  *out = (srv_s3_credentials){0};
  if (profile[0] == '\0') profile = "default";
  if (file[0] != '\0') return read_file(file, profile, out, error);
  if (key[0] != '\0') {
    bool is_read = copy(key, out->key, sizeof out->key) &&
                   copy(srv_s3_variable("AWS_SECRET_ACCESS_KEY"), out->secret, sizeof out->secret) &&
                   copy(srv_s3_variable("AWS_SESSION_TOKEN"), out->token, sizeof out->token) &&
                   out->secret[0] != '\0';
    return is_read || srv_fail(error, "AWS_ACCESS_KEY_ID needs an AWS_SECRET_ACCESS_KEY of usual length");
  }
  const char *shared = srv_s3_variable("AWS_SHARED_CREDENTIALS_FILE");
  if (shared[0] != '\0') return read_file(shared, profile, out, error);
  const char *home = srv_s3_variable("HOME");
  char path[PATH_MAX];
  int length = snprintf(path, sizeof path, "%s/.aws/credentials", home);
  bool is_there = home[0] != '\0' && length < PATH_MAX && access(path, F_OK) == 0;
  if (is_there) return read_file(path, profile, out, error);
  return srv_fail(error,
                  "no credentials: give --s3-credentials, or AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY");
}
