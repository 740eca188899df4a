# The pages over the wire, and what the build makes of it without npm. What the page does: tests/browser.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

@test "clients that ask for identity, or name no coding, get the bytes that others get as gzip" {
  http GET / --header "Accept-Encoding: gzip"
  expect 200
  [[ $(header content-encoding) == gzip ]]
  gunzip <answer >page
  [[ $(head -c 15 page) == "<!doctype html>" ]]
  http GET / --header "Accept-Encoding: identity"
  [[ -z $(header content-encoding) ]]
  cmp answer page
  http GET /
  [[ -z $(header content-encoding) ]]
  cmp answer page
}

@test "what comes by brotli unpacks to the same bytes, and is shorter" {
  for path in / /docs /viewer.js; do
    http GET "$path"
    mv answer plain
    http GET "$path" --header "Accept-Encoding: gzip, deflate, br, zstd"
    [[ $(header content-encoding) == br && $(header vary) == *Accept-Encoding* ]]
    node -e 'process.stdout.write(zlib.brotliDecompressSync(fs.readFileSync("answer")))' | cmp - plain
    mv answer short
    http GET "$path" --header "Accept-Encoding: gzip"
    (($(wc -c <short) < $(wc -c <answer)))
  done
}

@test "the page has under 300 kB in each coding" {
  for coding in br gzip zstd; do
    http GET / --header "Accept-Encoding: $coding"
    [[ $(header content-encoding) == "$coding" ]]
    (($(wc -c <answer) < 300000))
  done
}

@test "the API reference is packed, sent once, and asks nobody but the daemon" {
  http GET /docs --header "Accept-Encoding: gzip"
  expect 200
  [[ $(header content-encoding) == gzip ]]
  (($(wc -c <answer) < 600000))
  policy=$(header content-security-policy)
  [[ $policy == *"default-src 'none'; script-src 'sha256-"* && $policy == *"connect-src 'self'"* ]]
  [[ $policy != *unsafe* && $policy != *http* ]]
  http GET /docs --header "Accept-Encoding: gzip" --header "If-None-Match: $(header etag)"
  expect 304
}

@test "the example is the file of the tree" {
  http GET /example.html
  expect 200
  cmp answer "$root/server/page/example.html"
  [[ $(header content-security-policy) == *"connect-src 'self' blob: data:"* ]]
}

@test "without npm the page says what is missing" {
  mkdir bare
  ln -s "$(command -v cmake)" "$(command -v gzip)" "$(command -v od)" "$(command -v sed)" bare/
  PATH=$PWD/bare cmake "-DSOURCE=$root/server/page" "-DFOLDER=$PWD/page" "-DOUTPUT=$PWD/page.c" -P "$root/server/page.cmake"
  for name in page docs; do
    gunzip <"page/$name.gz" | grep "npm and node were not found"
  done
  gunzip <page/example.gz | cmp - "$root/server/page/example.html"
  grep "^static const unsigned char page\[\] =" page.c
  [[ ! -e page.c.whole ]] # the next build tries again
}
