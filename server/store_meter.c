/* What is absent is no error of the store. A probe tells what a thread of the store's own found: it is no
 * operation. */
#include "store_meter.h"

#include "machine.h"

static api_store_status note(const srv_store_meter *meter, srv_store_operation operation, uint64_t began_ns,
                             api_store_status status) {
  bool has_failed =
      status == API_STORE_DAMAGED || status == API_STORE_UNAVAILABLE || status == API_STORE_FULL;
  srv_metrics_store(meter->metrics, operation, srv_now_ns() - began_ns, has_failed);
  return status;
}

static api_store_status put(void *context, const char *id, api_bytes bytes, const char *summary,
                            bool *existed) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = srv_now_ns();
  return note(meter, SRV_STORE_PUT, began_ns,
              meter->store.put(meter->store.context, id, bytes, summary, existed));
}

static api_store_status open_object(void *context, const char *id, api_blob *out) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = srv_now_ns();
  return note(meter, SRV_STORE_OPEN, began_ns, meter->store.open(meter->store.context, id, out));
}

/* Without waiting it only recalls what an earlier look found. */
static api_store_status look(void *context, const char *id, bool may_wait) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = may_wait ? srv_now_ns() : 0;
  api_store_status status = meter->store.look(meter->store.context, id, may_wait);
  return may_wait ? note(meter, SRV_STORE_LOOK, began_ns, status) : status;
}

static api_store_status drop(void *context, const char *id) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = srv_now_ns();
  return note(meter, SRV_STORE_REMOVE, began_ns, meter->store.remove(meter->store.context, id));
}

static char *summary_of(void *context, const char *id) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = srv_now_ns();
  char *summary = meter->store.summary(meter->store.context, id);
  note(meter, SRV_STORE_SUMMARY, began_ns, API_STORE_OK);
  return summary;
}

static api_store_status list(void *context, const char *after, size_t limit, api_listed *out, size_t *count,
                             bool *more) {
  const srv_store_meter *meter = context;
  uint64_t began_ns = srv_now_ns();
  return note(meter, SRV_STORE_LIST, began_ns,
              meter->store.list(meter->store.context, after, limit, out, count, more));
}

static api_store_status probe(void *context) {
  const srv_store_meter *meter = context;
  return meter->store.probe(meter->store.context);
}

api_store srv_store_metered(srv_store_meter *meter) {
  return (api_store){.context = meter,
                     .put = put,
                     .open = open_object,
                     .look = look,
                     .remove = drop,
                     .summary = summary_of,
                     .list = list,
                     .probe = probe};
}
