# The folder of models: whole files or nothing, kept over restarts.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  start_daemon
}
teardown() { stop_daemon; }

# files: what the data folder holds, temporary names included.
files() { (cd "$data" && find . -type f | sort); }

# again: starts the daemon on the same folder.
again() { start_daemon; }

@test "models outlive the daemon" {
  upload "$samples/octopus.obj"
  cube=$id
  get "/v1/models/$id"
  cp answer before
  stop_daemon
  again
  get "/v1/models/$cube"
  expect 200
  diff <(jq -S . before) <(jq -S . answer)
  get "/v1/models/$cube/source"
  cmp answer "$samples/octopus.obj"
  post /v1/models "$samples/octopus.obj"
  expect 200
}

@test "an upload cut by kill -9 leaves the store as it was" {
  upload "$samples/cube.obj"
  files >before
  # An upload that comes slowly, and the end of the daemon in the middle of it.
  { cat "$samples/octopus.obj"; head -c 30000000 /dev/zero | tr '\0' '\n'; } >long.obj
  curl --silent --output /dev/null --limit-rate 3M --data-binary @long.obj --header 'Content-Type: model/obj' \
    "$url/v1/models" 3>&- &
  client=$!
  sleep 2
  kill -0 "$client"
  kill -KILL "$daemon"
  wait "$daemon" || true
  wait "$client" || true
  again
  files >after
  diff before after
  get /v1/models
  holds "[.models[].id] == [\"$id\"]"
  # The same bytes go in whole afterwards.
  post /v1/models long.obj
  expect 201
  get "/v1/models/$(value .id)/source"
  cmp answer long.obj
}

@test "a client that hangs up in the middle leaves nothing" {
  upload "$samples/cube.obj"
  files >before
  head -c 20000000 /dev/zero | tr '\0' '\n' >long.obj
  timeout 1 curl --silent --output /dev/null --limit-rate 3M --data-binary @long.obj \
    --header 'Content-Type: model/obj' "$url/v1/models" || true
  for _ in $(seq 50); do
    files >after
    diff -q before after >/dev/null && break
    sleep 0.1
  done
  diff before after
  get /healthz
  expect 200
}

@test "temporary files of a daemon that was killed are cleared away" {
  stop_daemon
  files >before
  again
  # Many uploads, each killed at another moment of writing.
  for i in 1 2 3 4 5; do
    { cat "$samples/octopus.obj"; echo "# $i"; head -c 5000000 /dev/zero | tr '\0' '\n'; } >model.obj
    curl --silent --output /dev/null --data-binary @model.obj "$url/v1/models" 3>&- &
    client=$!
    sleep "0.0$i"
    kill -KILL "$daemon"
    wait "$daemon" || true
    wait "$client" || true
    again
    # Whatever is listed is whole.
    get '/v1/models?limit=100'
    for id in $(value '.models[].id'); do
      get "/v1/models/$id/source"
      expect 200
      [ "$(sha256sum answer | head -c 32)" = "$id" ]
    done
  done
  for id in $(get '/v1/models?limit=100' && value '.models[].id'); do http DELETE "/v1/models/$id"; done
  stop_daemon
  files >after
  diff before after
}

@test "what is in the folder and is no model is not served" {
  upload "$samples/cube.obj"
  find "$data" -type d | while read -r folder; do echo stray >"$folder/notes.txt"; done
  get '/v1/models?limit=100'
  holds '.models | length == 1'
  get /v1/models/notes.txt
  [[ $status == 40[04] ]]
}

@test "a folder that cannot be written is one clear line at start" {
  touch file
  run "${TWEEND_BINARY:-$root/build/tweend}" --listen 127.0.0.1:0 --data "$PWD/file/data"
  [ "$status" -ne 0 ]
  [ "${#lines[@]}" -eq 1 ]
  [[ $output == *file/data* ]]
}
