# The page at / over the wire, and what the build makes of it without npm. What the page does: tests/browser.

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

@test "without npm the page says what is missing" {
  mkdir bare
  ln -s "$(command -v cmake)" "$(command -v gzip)" bare/
  PATH=$PWD/bare cmake "-DSOURCE=$root/server/page" "-DFOLDER=$PWD/page" "-DOUTPUT=$PWD/page.c" -P "$root/server/page.cmake"
  gunzip <page/missing.html.gz | grep "npm and node were not found"
  grep "^const unsigned char srv_page\[\] = {" page.c
  [[ ! -e page.c.whole ]] # the next build tries again
}
