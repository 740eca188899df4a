/* Settings from flags and environment, and the files that some of them name. */
#ifndef SRV_CONFIG_H
#define SRV_CONFIG_H

#include "api.h"
#include "fail.h"
#include "log.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* Where a bucket's name goes in its URLs: in the path or in the host name. AUTO: in the path when
 * --s3-endpoint is given, else in the host name. */
typedef enum srv_s3_style { SRV_S3_AUTO, SRV_S3_PATH, SRV_S3_VIRTUAL } srv_s3_style;

/* A value: deinit frees it. Numbers are in bytes, milliseconds or plain counts, checked against the
 * ranges of their flags. */
typedef struct srv_config {
  char *listen, *admin_listen;                    /* addresses; admin_listen: "" for none */
  char *data;                                     /* a folder, or s3://BUCKET/PREFIX */
  char *s3_endpoint, *s3_region, *s3_credentials; /* "": defaults */
  uint64_t s3_style;                              /* srv_s3_style */
  uint64_t s3_timeout;
  char *cache_dir; /* the local folder when `data` is s3:// */
  uint64_t cache_size;
  uint64_t store_limit, spool_limit; /* bytes; 0: no limit */
  uint64_t min_free;                 /* bytes; 0: none; SRV_MIN_FREE_AUTO: by the size of the file system */
  uint64_t threads, io_threads, queue, max_connections, max_connections_per_address, max_listeners;
  api_rate rate_limit;   /* of one address */
  char *trusted_proxies; /* see srv_networks_read */
  uint64_t max_upload, max_level, max_faces, max_output, max_times, plan_cache, max_memory;
  uint64_t header_timeout, idle_timeout, request_timeout, drain_timeout, drain_delay;
  uint64_t compute_timeout;   /* 0: none */
  uint64_t min_rate;          /* bytes a second that a client must send or receive */
  char *api_keys, *url_keys;  /* lists or @FILE, see keyring.h */
  char *cors_origins, *hosts; /* hosts: names or addresses without ports, or "*" */
  char *tls_cert, *tls_key;   /* paths, "" without TLS */
  char *log_level;            /* a name or @FILE, see srv_config_log_level */
  uint64_t log_format;        /* srv_log_format */
  bool sample;
  bool check;
  bool healthcheck;
} srv_config;

typedef enum srv_config_status {
  SRV_CONFIG_RUN,  /* go on with *config */
  SRV_CONFIG_DONE, /* --help, --man or --version has been printed to out */
  SRV_CONFIG_BAD   /* error holds one line */
} srv_config_status;

/* argv: as passed to main. environment: like getenv. Flags override TWEEND_* variables, which override the
 * defaults. out: for --help, --man and --version. *config must be deinited whatever the status. */
srv_config_status srv_config_read(srv_config *config, int argc, char *const *argv,
                                  char *(*environment)(const char *name), FILE *out, srv_error *error);
void srv_config_deinit(srv_config *config);

/* Whether models are stored in a bucket. */
bool srv_config_is_s3(const srv_config *config);

/* Logs a warning for each TWEEND_ variable that is no setting, with the nearest name. environment: as
 * environ. */
void srv_config_warn(char *const *environment);

/* The text of the setting, or of the file when the setting is "@FILE". malloc'ed; NULL with one line in
 * error. */
char *srv_config_text(const char *flag, const char *setting, size_t size_max, srv_error *error);

/* The log level, read from the file again when the setting is "@FILE". False with one line in error. */
bool srv_config_log_level(const srv_config *config, srv_log_level *out, srv_error *error);

/* ---- quantities as written in flags: 256MiB, 80M, 500ms -------------------------------------- */

/* Each function parses the whole text, or returns false and leaves *out alone. Rejected: signs, spaces,
 * fractions and values over 64 bits. */

/* Bytes, plain or with a unit: B, KiB, MiB, GiB, TiB (powers of 1024), kB, MB, GB, TB (powers of 1000). */
bool srv_parse_size(const char *text, uint64_t *out);

/* A number, plain or with k, M, G (powers of 1000). */
bool srv_parse_count(const char *text, uint64_t *out);

/* Milliseconds. A unit (ms, s, m or h) is required, except for 0. */
bool srv_parse_duration(const char *text, uint64_t *out);

/* At this rate over the shortest period, a second, a token takes one nanosecond, the resolution of rate.c. */
enum { SRV_RATE_MAX = 1000000000 };

/* A rate: 50/s, 100/m or 1000/h, from 1 to SRV_RATE_MAX in the unit. */
bool srv_parse_rate(const char *text, api_rate *out);

#endif
