// Numbers printed a second and core: by the way that a pose takes through api/, evaluation included, and by
// the printer alone beside std::to_chars. usage: print_bench [JSON]
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "bench_model.h"
#include "report.h"
#include "tweend/base.h"

extern "C" {
#include "api.h"
}

namespace {

constexpr size_t BLOCK = 256 << 10;

void fail(const std::string &what) {
  std::fprintf(stderr, "print_bench: %s\n", what.c_str());
  std::exit(1);
}

// A store that takes everything and has nothing: the model stays in the cache.
api_store_status put(void *, const char *, api_bytes, const char *, bool *existed) {
  *existed = false;
  return API_STORE_OK;
}

api_store_status open(void *, const char *, api_blob *) {
  return API_STORE_ABSENT;
}

api_request request_of(const char *method, const char *path, const char *query) {
  api_request request = {};
  request.method = method;
  request.path = path;
  request.query = query;
  request.id = "bench";
  request.header = [](void *, const char *name) -> const char * {
    return std::strcmp(name, "Content-Length") == 0 ? "1" : nullptr;
  };
  return request;
}

// Reads the answer to its end; returns its bytes.
uint64_t drain(api_answer &answer, std::vector<uint8_t> &block) {
  if (answer.status != 200 && answer.status != 201)
    fail(std::string(reinterpret_cast<const char *>(answer.bytes.data), answer.bytes.size));
  uint64_t size = answer.bytes.size;
  int64_t got = 0;
  while (answer.body.read && (got = answer.body.read(answer.body.context, block.data(), block.size())) > 0)
    size += static_cast<uint64_t>(got);
  api_answer_deinit(&answer);
  return size;
}

std::string upload(api_service *service, int joints) {
  size_t size = 0;
  char *model = bench_model(joints, 100, &size);
  api_request request = request_of("POST", "/v1/models", "");
  request.body = {reinterpret_cast<const uint8_t *>(model), size};
  api_answer answer = {};
  api_ticket ticket = {};
  request.ticket = &ticket;
  api_handle(service, &request, API_HEAVY, &answer);
  std::string text(reinterpret_cast<const char *>(answer.bytes.data), answer.bytes.size);
  size_t id = text.find("\"id\":\"");
  if (id == std::string::npos) fail(text);
  api_answer_deinit(&answer);
  api_ticket_end(service, &ticket);
  std::free(model);
  return text.substr(id + 6, 32);
}

// Million numbers a second of a whole answer, at other times in each run: the service keeps answers.
void bench_answer(bench_report &report, api_service *service, const std::string &path, const char *form,
                  const char *options, int joints, int width) {
  constexpr int POSES = 1001;
  std::string whole = path + "/pose." + form;
  std::vector<uint8_t> block(BLOCK);
  std::array<double, BENCH_RUNS> runs = {};
  uint64_t size = 0;
  for (int run = -1; run < BENCH_RUNS; run++) {
    std::string shift = std::to_string(1e-6 * (run + 1)).substr(1); // ".000001"
    std::string query = "from=0";
    query.append(shift).append("&to=10").append(shift).append("&fps=100").append(options);
    api_request request = request_of("GET", whole.c_str(), query.c_str());
    api_answer answer = {};
    api_ticket ticket = {};
    request.ticket = &ticket;
    double start = bench_now();
    api_handle(service, &request, API_HEAVY, &answer);
    size = drain(answer, block);
    if (run >= 0) runs[static_cast<size_t>(run)] = 1e-6 * POSES * joints * width / (bench_now() - start);
    api_ticket_end(service, &ticket);
  }
  std::string name = std::string("pose.") + form + options + ", " + std::to_string(size / 1000) + " kB";
  bench_row(&report, name.c_str(), "million numbers/s", bench_summary(runs.data()), nullptr, {}, true);
}

// Quaternions of numbers of eight and nine digits.
void bench_printer(bench_report &report) {
  constexpr size_t WIDTH = 4, COUNT = 10000;
  std::vector<float> values(WIDTH * COUNT);
  const tw_vectors vectors = {values.data(), WIDTH, WIDTH, COUNT, nullptr};
  std::vector<char> text(values.size() * (TW_NUMBER_TEXT + 1));
  for (float &value : values) value = static_cast<float>(bench_random() - 0.5);
  std::array<double, BENCH_RUNS> ours = {}, theirs = {};
  for (size_t run = 0; run < BENCH_RUNS; run++) {
    double start = bench_now();
    size_t size = tw_print_vectors(text.data(), &vectors);
    double middle = bench_now();
    char *end = text.data();
    for (float value : values) {
      end = std::to_chars(end, end + TW_NUMBER_TEXT, value).ptr;
      *end++ = ',';
    }
    size_t brackets = 2 * COUNT;
    if (static_cast<size_t>(end - text.data()) + brackets != size + 1) fail("the printers differ");
    ours[run] = 1e-6 * static_cast<double>(values.size()) / (middle - start);
    theirs[run] = 1e-6 * static_cast<double>(values.size()) / (bench_now() - middle);
  }
  bench_scene(&report, "printing floats in [-0.5, 0.5)");
  bench_row(&report, "tw_print_vectors", "million numbers/s", bench_summary(ours.data()), "std::to_chars",
            bench_summary(theirs.data()), true);
}

} // namespace

int main(int argc, char **argv) {
  bench_report report;
  bench_open(&report, argc > 1 ? argv[1] : nullptr);
  bench_printer(report);
  api_settings settings = {};
  settings.limits.max_upload = settings.limits.max_output = settings.limits.plan_cache = 1 << 30;
  settings.limits.max_times = 1 << 20;
  settings.limits.max_memory = UINT64_C(1) << 32;
  settings.store.put = put;
  settings.store.open = open;
  settings.store.look = [](void *, const char *, bool) { return API_STORE_OK; };
  settings.store.summary = [](void *, const char *) -> char * { return nullptr; };
  api_service *service = api_service_create(&settings);
  if (!service) fail("no memory");
  for (int joints : {24, 100}) {
    std::string path = "/v1/models/" + upload(service, joints);
    bench_scene(&report, "1,001 poses of %d joints through api/", joints);
    bench_answer(report, service, path, "json", "", joints, 10);
    bench_answer(report, service, path, "csv", "", joints, 10);
    bench_answer(report, service, path, "json", "&as=matrix&space=world", joints, 16);
    bench_answer(report, service, path, "bin", "&as=matrix&space=world", joints, 16);
  }
  api_service_destroy(service);
  bench_close(&report);
  return 0;
}
