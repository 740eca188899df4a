/* Sends one request over one connection; implements no more HTTP than that needs. */
#include "healthcheck.h"

#include <errno.h>
#include <gnutls/gnutls.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { TIMEOUT_MS = 3000, STATUS_LINE_SIZE = 13 }; /* "HTTP/1.1 200 " */

static const char probe[] = "GET /readyz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";

/* Sends the request and reads the start of the answer. */
static bool ask_plain(int fd, char *status_line) {
  if (send(fd, probe, sizeof probe - 1, MSG_NOSIGNAL) != (ssize_t)(sizeof probe - 1)) return false;
  return recv(fd, status_line, STATUS_LINE_SIZE, MSG_WAITALL) == STATUS_LINE_SIZE;
}

static bool exchange_tls(gnutls_session_t session, int fd, char *status_line) {
  gnutls_transport_set_int(session, fd);
  gnutls_handshake_set_timeout(session, TIMEOUT_MS);
  int done;
  do {
    done = gnutls_handshake(session);
  } while (done < 0 && gnutls_error_is_fatal(done) == 0);
  if (done < 0) return false;
  if (gnutls_record_send(session, probe, sizeof probe - 1) != (ssize_t)(sizeof probe - 1)) return false;
  size_t size = 0;
  while (size < STATUS_LINE_SIZE) {
    ssize_t got = gnutls_record_recv(session, status_line + size, STATUS_LINE_SIZE - size);
    if (got <= 0) return false;
    size += (size_t)got;
  }
  return true;
}

static bool ask_tls(int fd, char *status_line) {
  gnutls_certificate_credentials_t credentials;
  gnutls_session_t session;
  if (gnutls_certificate_allocate_credentials(&credentials) != GNUTLS_E_SUCCESS) return false;
  bool asked = false;
  if (gnutls_init(&session, GNUTLS_CLIENT) == GNUTLS_E_SUCCESS) {
    asked = gnutls_set_default_priority(session) == GNUTLS_E_SUCCESS &&
            gnutls_credentials_set(session, GNUTLS_CRD_CERTIFICATE, credentials) == GNUTLS_E_SUCCESS &&
            exchange_tls(session, fd, status_line);
    gnutls_deinit(session);
  }
  gnutls_certificate_free_credentials(credentials);
  return asked;
}

bool srv_healthcheck(const srv_address *address, bool tls) {
  int fd = srv_address_connect(address, TIMEOUT_MS);
  if (fd < 0) {
    fprintf(stderr, "tweend: healthcheck: no connection: %s\n", strerror(errno));
    return false;
  }
  char status_line[STATUS_LINE_SIZE + 1] = "";
  bool answered = tls ? ask_tls(fd, status_line) : ask_plain(fd, status_line);
  close(fd);
  bool ready = answered && strcmp(status_line, "HTTP/1.1 200 ") == 0;
  if (!ready) fprintf(stderr, "tweend: healthcheck: not ready: %s\n", answered ? status_line : "no answer");
  return ready;
}
