/* Settings from flags and environment. */
#ifndef SRV_CONFIG_H
#define SRV_CONFIG_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* A value: deinit frees it. Numbers are in bytes, milliseconds or plain counts, checked against the
 * ranges of their flags. */
typedef struct srv_config {
  char *listen;
  char *data;
  uint64_t threads, io_threads, queue, max_connections, max_listeners;
  uint64_t max_upload, max_level, max_faces, max_output, max_times, plan_cache, max_memory;
  uint64_t header_timeout, idle_timeout, request_timeout, drain_timeout;
  uint64_t min_rate; /* bytes a second that a client must take or give */
  char *api_keys_text;
  char **api_keys; /* NULL-terminated; NULL: none are asked for */
  char *cors_origins;
  char *tls_cert, *tls_key;       /* paths, "" without TLS */
  uint64_t log_level, log_format; /* srv_log_level, srv_log_format */
  bool sample;
  bool healthcheck;
} srv_config;

typedef enum srv_config_status {
  SRV_CONFIG_RUN,  /* go on with *config */
  SRV_CONFIG_DONE, /* --help or --version has been printed to out */
  SRV_CONFIG_BAD   /* error holds one line */
} srv_config_status;

/* argv as main gets it; environment answers as getenv does. Flags win over TWEEND_* variables, those
 * over the defaults. *config is to be deinited whatever the status. */
srv_config_status srv_config_read(srv_config *config, int argc, char *const *argv,
                                  char *(*environment)(const char *name), FILE *out, char *error,
                                  size_t error_size);
void srv_config_deinit(srv_config *config);

#endif
