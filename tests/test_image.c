// Pictures and videos as files: whole, the same every time, and never at the cost of what was
// there.
#include "client/image.h"
#include "client/video.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#define MOST_BYTES 65536 // of a file here

// A directory of our own for each test, and paths in it.
typedef struct Place {
    char directory[64];
    char path[128];
} Place;

static const char* place_path(Place* place, const char* name)
{
    snprintf(place->path, sizeof place->path, "%s/%s", place->directory, name);
    return place->path;
}

static int make_place(void** state)
{
    Place* place = calloc(1, sizeof *place);
    snprintf(place->directory, sizeof place->directory, P_tmpdir "/strandcast-image-XXXXXX");
    *state = place;
    return mkdtemp(place->directory) ? 0 : -1;
}

static int count_files(const Place* place, bool remove_them)
{
    int count = 0;
    DIR* directory = opendir(place->directory);
    for (struct dirent* entry; (entry = readdir(directory));) {
        if (entry->d_name[0] == '.') continue;
        count++;
        if (remove_them) unlinkat(dirfd(directory), entry->d_name, 0);
    }
    closedir(directory);
    return count;
}

static int remove_place(void** state)
{
    Place* place = *state;
    count_files(place, true);
    const int result = rmdir(place->directory);
    free(place);
    return result;
}

static Image make_picture(int width, int height, int seed)
{
    Image image;
    Fault fault;
    assert_true(image_create(&image, width, height, &fault));
    uint32_t random = (uint32_t)seed * 2654435761u + 1;
    for (int i = 0; i < width * height * 4; i++) {
        random = random * 1664525u + 1013904223u;
        image.rgba[i] = (uint8_t)((random >> 24) / 4 + (uint32_t)(i / 4 % width));
    }
    return image;
}

static void must(bool ok, const Fault* fault)
{
    if (!ok) print_error("fault: %s\n", fault->text);
    assert_true(ok);
}

static void expect_words(const Fault* fault, const char* one, const char* other)
{
    if (!strstr(fault->text, one) || !strstr(fault->text, other))
        print_error("fault: %s\n", fault->text);
    assert_non_null(strstr(fault->text, one));
    assert_non_null(strstr(fault->text, other));
}

static size_t read_bytes(const char* path, uint8_t* bytes, size_t size)
{
    FILE* file = fopen(path, "rb");
    assert_non_null(file);
    const size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

// A picture as a PNG at `path`, and its bytes.
static size_t written_bytes(const char* path, int width, int height, uint8_t bytes[MOST_BYTES])
{
    Fault fault;
    Image image = make_picture(width, height, 1);
    must(image_write_png(&image, path, true, &fault), &fault);
    image_free(&image);
    return read_bytes(path, bytes, MOST_BYTES);
}

static void write_bytes(const char* path, const void* bytes, size_t count)
{
    FILE* file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, count, file), count);
    fclose(file);
}

static void png_returns_every_pixel(void** state)
{
    Place* place = *state;
    Fault fault;
    const int sizes[][2] = {{1, 1}, {7, 3}, {64, 48}, {333, 1}};
    for (int i = 0; i < 4; i++) {
        Image image = make_picture(sizes[i][0], sizes[i][1], i), back;
        const char* path = place_path(place, "a.png");
        must(image_write_png(&image, path, true, &fault), &fault);
        must(image_read_png(&back, path, &fault), &fault);
        assert_int_equal(back.width, image.width);
        assert_int_equal(back.height, image.height);
        assert_memory_equal(back.rgba, image.rgba, (size_t)image.width * (size_t)image.height * 4);
        image_free(&back);
        image_free(&image);
    }
    assert_int_equal(count_files(place, false), 1);
}

static void png_without_alpha_keeps_the_colours(void** state)
{
    Place* place = *state;
    Fault fault;
    Image image = make_picture(31, 17, 5), back;
    const char* path = place_path(place, "a.png");
    must(image_write_png(&image, path, false, &fault), &fault);
    uint8_t header[32];
    assert_int_equal(read_bytes(path, header, sizeof header), sizeof header);
    assert_int_equal(header[25], 2); // colour type RGB
    must(image_read_png(&back, path, &fault), &fault);
    for (int i = 0; i < 31 * 17; i++) {
        assert_memory_equal(back.rgba + i * 4, image.rgba + i * 4, 3);
        assert_int_equal(back.rgba[i * 4 + 3], 255);
    }
    image_free(&back);
    image_free(&image);
}

static void png_bytes_depend_on_the_pixels_only(void** state)
{
    Place* place = *state;
    Fault fault;
    static uint8_t first[MOST_BYTES], second[MOST_BYTES];
    Image image = make_picture(64, 48, 1);
    must(image_write_png(&image, place_path(place, "a.png"), false, &fault), &fault);
    const size_t count = read_bytes(place->path, first, sizeof first);
    assert_null(memmem(first, count, "tIME", 4)); // nor on when they were written
    assert_null(memmem(first, count, "tEXt", 4));
    must(image_write_png(&image, place_path(place, "b.png"), false, &fault), &fault);
    assert_int_equal(read_bytes(place->path, second, sizeof second), count);
    assert_memory_equal(first, second, count);
    image_free(&image);
}

static void flip_turns_rows_over(void** state)
{
    (void)state;
    for (int height = 1; height <= 4; height++) {
        Image image = make_picture(5, height, 2), turned = make_picture(5, height, 2);
        image_flip(&turned);
        for (int y = 0; y < height; y++)
            assert_memory_equal(turned.rgba + y * 20, image.rgba + (height - 1 - y) * 20, 20);
        image_free(&image);
        image_free(&turned);
    }
}

static void sizes_beyond_the_caps_are_faults(void** state)
{
    (void)state;
    const int sizes[][2] = {{0, 5}, {5, 0}, {-1, 5}, {IMAGE_MAX_SIDE + 1, 1}, {16384, 16384}};
    for (int i = 0; i < 5; i++) {
        Fault fault = {""};
        Image image;
        assert_false(image_create(&image, sizes[i][0], sizes[i][1], &fault));
        assert_null(image.rgba);
        expect_words(&fault, "edges must be 1 to 16384", "");
    }
}

static void put_be32(uint8_t* at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (24 - 8 * i));
}

static uint32_t crc_of(const uint8_t* bytes, size_t count)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = (crc >> 1) ^ ((crc & 1) ? 0xedb88320u : 0);
    }
    return ~crc;
}

static void reading_refuses_a_header_that_claims_too_much(void** state)
{
    Place* place = *state;
    Fault fault;
    static uint8_t bytes[MOST_BYTES];
    Image back;
    const char* path = place_path(place, "a.png");
    const size_t count = written_bytes(path, 8, 8, bytes);
    const uint32_t sides[] = {16384, 65536, 0x7fffffff};
    for (int i = 0; i < 3; i++) {
        put_be32(bytes + 16, sides[i]);
        put_be32(bytes + 20, sides[i]);
        put_be32(bytes + 29, crc_of(bytes + 12, 17));
        write_bytes(path, bytes, count);
        assert_false(image_read_png(&back, path, &fault));
        assert_null(back.rgba);
        expect_words(&fault, path, i < 2 ? "edges must be" : "PNG");
    }
}

static void reading_rejects_every_truncation(void** state)
{
    Place* place = *state;
    Fault fault;
    static uint8_t bytes[MOST_BYTES];
    Image back;
    const char* path = place_path(place, "a.png");
    const size_t count = written_bytes(path, 9, 6, bytes);
    // Up to the check sum of the pixels; the 12 bytes of IEND carry nothing.
    for (size_t kept = 0; kept < count - 16; kept++) {
        write_bytes(path, bytes, kept);
        if (image_read_png(&back, path, &fault))
            fail_msg("a PNG of %zu bytes cut to %zu was read", count, kept);
        assert_null(back.rgba);
        expect_words(&fault, path, "PNG");
    }
}

static void reading_survives_every_damaged_byte(void** state)
{
    Place* place = *state;
    Fault fault;
    static uint8_t bytes[MOST_BYTES];
    Image back;
    const char* path = place_path(place, "a.png");
    const size_t count = written_bytes(path, 9, 6, bytes);
    for (size_t i = 0; i < count; i++) {
        bytes[i] ^= 0x55;
        write_bytes(path, bytes, count);
        if (image_read_png(&back, path, &fault)) image_free(&back);
        assert_null(back.rgba);
        bytes[i] ^= 0x55;
    }
}

static void reading_names_a_file_that_is_not_there(void** state)
{
    Place* place = *state;
    Fault fault;
    Image image;
    assert_false(image_read_png(&image, place_path(place, "none.png"), &fault));
    expect_words(&fault, "none.png", "No such file");
    assert_false(image_read_png(&image, place->directory, &fault));
    expect_words(&fault, place->directory, "");
}

static void place_that_cannot_be_written_is_a_fault(void** state)
{
    Place* place = *state;
    Fault fault;
    Image image = make_picture(4, 4, 1);
    assert_false(image_write_png(&image, place_path(place, "no/such/a.png"), false, &fault));
    expect_words(&fault, "no/such/a.png", "No such file or directory");
    assert_false(image_write_png(&image, place->directory, false, &fault));
    expect_words(&fault, place->directory, "is a directory");
    // /proc refuses root too; a directory without write permission refuses everybody else.
    assert_false(image_write_png(&image, "/proc/strandcast.png", false, &fault));
    expect_words(&fault, "/proc/strandcast.png", "cannot write");
    assert_null(video_open("/proc/strandcast.mp4", 16, 16, 30, &fault));
    expect_words(&fault, "/proc/strandcast.mp4", "cannot write");
    if (geteuid() != 0) {
        chmod(place->directory, 0555);
        assert_false(image_write_png(&image, place_path(place, "a.png"), false, &fault));
        chmod(place->directory, 0755);
        expect_words(&fault, "a.png", "Permission denied");
    }
    image_free(&image);
}

// A renamed file in the place of /dev/null would be felt by the whole machine.
static void pipes_and_devices_are_written_in_place(void** state)
{
    Place* place = *state;
    Fault fault;
    struct stat info;
    uint8_t bytes[8];
    Image image = make_picture(4, 4, 1);
    const char* path = place_path(place, "pipe.png");
    assert_int_equal(mkfifo(path, 0600), 0);
    const int reader = open(path, O_RDWR | O_NONBLOCK);
    const bool written = image_write_png(&image, path, true, &fault);
    assert_int_equal(stat(path, &info), 0);
    const ssize_t got = read(reader, bytes, sizeof bytes);
    close(reader);
    image_free(&image);
    must(written, &fault);
    assert_true(S_ISFIFO(info.st_mode));
    assert_int_equal(got, 8);
    assert_memory_equal(bytes, "\x89PNG\r\n\x1a\n", 8);
}

static void full_disk_is_a_fault(void** state)
{
    Place* place = *state;
    Fault fault;
    struct stat info;
    // Should the promise above ever break, this test run by root would replace the real device.
    pipes_and_devices_are_written_in_place(state);
    assert_int_equal(count_files(place, true), 1);
    Image image = make_picture(64, 64, 1);
    assert_false(image_write_png(&image, "/dev/full", false, &fault));
    expect_words(&fault, "/dev/full", "No space left on device");
    assert_int_equal(stat("/dev/full", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    image_free(&image);
}

static void failed_write_leaves_the_good_file(void** state)
{
    Place* place = *state;
    Fault fault;
    Image small = make_picture(8, 8, 1), large = make_picture(256, 256, 2), back;
    const char* path = place_path(place, "a.png");
    must(image_write_png(&small, path, true, &fault), &fault);
    // A file size limit plays the full disk, half-way through the picture.
    struct rlimit before, limit;
    getrlimit(RLIMIT_FSIZE, &before);
    limit = (struct rlimit){20000, before.rlim_max};
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
    const bool written = image_write_png(&large, path, true, &fault);
    setrlimit(RLIMIT_FSIZE, &before);
    signal(SIGXFSZ, handler);
    assert_false(written);
    expect_words(&fault, path, "File too large");
    must(image_read_png(&back, path, &fault), &fault);
    assert_int_equal(back.width, 8);
    assert_int_equal(count_files(place, false), 1);
    image_free(&back);
    image_free(&small);
    image_free(&large);
}

static void link_to_a_picture_stays_a_link(void** state)
{
    Place* place = *state;
    Fault fault;
    char target[128];
    struct stat info;
    Image image = make_picture(8, 8, 1), back;
    snprintf(target, sizeof target, "%s", place_path(place, "real.png"));
    must(image_write_png(&image, target, true, &fault), &fault);
    const char* path = place_path(place, "link.png");
    assert_int_equal(symlink("real.png", path), 0);
    image.rgba[0] ^= 0xff;
    must(image_write_png(&image, path, true, &fault), &fault);
    assert_int_equal(lstat(path, &info), 0);
    assert_true(S_ISLNK(info.st_mode));
    must(image_read_png(&back, target, &fault), &fault);
    assert_int_equal(back.rgba[0], image.rgba[0]);
    image_free(&back);
    image_free(&image);
}

static int probe_int(const char* path, const char* entry)
{
    char command[400];
    int value = -1;
    snprintf(command, sizeof command,
             "ffprobe -v error -count_frames -select_streams v:0 -show_entries stream=%s "
             "-of csv=p=0 '%s'",
             entry, path);
    FILE* pipe = popen(command, "r");
    if (!pipe || fscanf(pipe, "%d", &value) != 1) value = -1;
    if (pipe) pclose(pipe);
    return value;
}

static bool write_video(const char* path, int width, int height, int frames, Fault* fault)
{
    Video* video = video_open(path, width, height, 30, fault);
    if (!video) return false;
    bool ok = true;
    for (int i = 0; ok && i < frames; i++) {
        Image image = make_picture(width, height, i);
        ok = video_frame(video, &image, fault);
        image_free(&image);
    }
    return video_close(video, ok ? fault : NULL) && ok;
}

static void video_of_ten_frames_has_ten(void** state)
{
    Place* place = *state;
    Fault fault;
    const char* path = place_path(place, "a.mp4");
    must(write_video(path, 64, 48, 10, &fault), &fault);
    assert_int_equal(probe_int(path, "nb_read_frames"), 10);
    assert_int_equal(probe_int(path, "width"), 64);
    assert_int_equal(probe_int(path, "height"), 48);
    assert_int_equal(count_files(place, false), 1);
}

// ffmpeg takes "a:" for a protocol and "-a" for an option.
static void video_name_is_a_file_name_whatever_it_looks_like(void** state)
{
    Place* place = *state;
    Fault fault;
    const int back = open(".", O_RDONLY | O_DIRECTORY);
    assert_int_equal(chdir(place->directory), 0);
    const bool colon = write_video("a:b.mp4", 32, 32, 2, &fault);
    const bool dash = write_video("-b.mp4", 32, 32, 2, &fault);
    assert_int_equal(fchdir(back), 0);
    close(back);
    assert_true(colon && dash);
    assert_int_equal(probe_int(place_path(place, "a:b.mp4"), "nb_read_frames"), 2);
    assert_int_equal(count_files(place, false), 2);
}

static void video_of_odd_size_is_cropped_to_even(void** state)
{
    Place* place = *state;
    Fault fault;
    const char* path = place_path(place, "a.mp4");
    must(write_video(path, 33, 19, 2, &fault), &fault);
    assert_int_equal(probe_int(path, "width"), 32);
    assert_int_equal(probe_int(path, "height"), 18);
}

static void video_refuses_a_frame_of_another_size(void** state)
{
    Place* place = *state;
    Fault fault;
    Video* video = video_open(place_path(place, "a.mp4"), 32, 32, 30, &fault);
    assert_non_null(video);
    Image good = make_picture(32, 32, 1), bad = make_picture(32, 31, 1);
    assert_false(video_frame(video, &bad, &fault));
    expect_words(&fault, "32x31", "32x32");
    must(video_frame(video, &good, &fault), &fault);
    must(video_close(video, &fault), &fault);
    image_free(&good);
    image_free(&bad);
}

static void video_without_frames_is_a_fault_and_no_file(void** state)
{
    Place* place = *state;
    Fault fault;
    assert_false(write_video(place_path(place, "a.mp4"), 32, 32, 0, &fault));
    expect_words(&fault, "a.mp4", "not one frame");
    assert_int_equal(count_files(place, false), 0);
    assert_null(video_open(place->path, 1, 32, 30, &fault));
    assert_null(video_open(place->path, 32, 32, 0, &fault));
    expect_words(&fault, "rate", "a.mp4");
}

static char* set_path(const char* value)
{
    char* before = strdup(getenv("PATH"));
    setenv("PATH", value, 1);
    return before;
}

static void restore_path(char* before)
{
    setenv("PATH", before, 1);
    free(before);
}

static void write_script(Place* place, const char* script, char* program, size_t size)
{
    snprintf(program, size, "%s/ffmpeg", place->directory);
    write_bytes(program, script, strlen(script));
    chmod(program, 0755);
}

// Runs with PATH set to the test's directory, where `script` (or nothing) is the ffmpeg.
static bool write_with_ffmpeg(Place* place, const char* script, const char* path, Fault* fault)
{
    char program[128] = "";
    if (script) write_script(place, script, program, sizeof program);
    char* before = set_path(place->directory);
    const bool ok = write_video(path, 256, 256, 10, fault);
    restore_path(before);
    unlink(program);
    return ok;
}

static void absent_ffmpeg_names_its_package(void** state)
{
    Place* place = *state;
    Fault fault;
    assert_false(write_with_ffmpeg(place, NULL, place_path(place, "a.mp4"), &fault));
    assert_string_equal(fault.text, "ffmpeg is not installed (apt-get install ffmpeg)");
    assert_int_equal(count_files(place, false), 0);
}

// SIGPIPE has its default action here and would end the test. The program must have read all there
// was before it went: data left unread make the next write a "connection reset", which has no
// signal.
static void closed_pipe_is_a_fault_and_no_signal(void** state)
{
    Place* place = *state;
    Fault fault;
    char program[128];
    assert_ptr_equal(signal(SIGPIPE, SIG_DFL), SIG_DFL);
    write_script(place, "#!/bin/sh\n/usr/bin/head -c 1024 >/dev/null\nexit 1\n", program,
                 sizeof program);
    char* before = set_path(place->directory);
    Video* video = video_open(place_path(place, "a.mp4"), 16, 16, 30, &fault);
    restore_path(before);
    assert_non_null(video);
    Image image = make_picture(16, 16, 1);
    must(video_frame(video, &image, &fault), &fault);
    // The pipe holds some frames; the one after those finds it closed, whenever the program ends.
    int taken = 0;
    while (taken < 10000 && video_frame(video, &image, &fault))
        ++taken;
    assert_true(taken < 10000);
    expect_words(&fault, "a.mp4", "ffmpeg stopped before the end");
    assert_false(video_close(video, &fault));
    image_free(&image);
    unlink(program);
    assert_int_equal(count_files(place, false), 0);
}

static void dying_ffmpeg_is_a_fault_with_its_last_words(void** state)
{
    Place* place = *state;
    Fault fault;
    const char* path = place_path(place, "a.mp4");
    write_bytes(path, "good", 4);
    assert_false(write_with_ffmpeg(
        place, "#!/bin/sh\necho first >&2\necho no such codec >&2\nexit 1\n", path, &fault));
    expect_words(&fault, "a.mp4", ": ffmpeg: no such codec");
    assert_false(write_with_ffmpeg(place, "#!/bin/sh\nkill -9 $$\n", path, &fault));
    expect_words(&fault, "a.mp4", "signal 9");
    // One that reads all and fails at the end, as on a full disk.
    assert_false(write_with_ffmpeg(
        place, "#!/bin/sh\n/bin/cat >/dev/null\necho disk full >&2\nexit 1\n", path, &fault));
    expect_words(&fault, "a.mp4", ": ffmpeg: disk full");
    uint8_t bytes[8];
    assert_int_equal(read_bytes(path, bytes, sizeof bytes), 4);
    assert_int_equal(count_files(place, false), 1);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, make_place, remove_place)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(png_returns_every_pixel),
        TEST(png_without_alpha_keeps_the_colours),
        TEST(png_bytes_depend_on_the_pixels_only),
        TEST(flip_turns_rows_over),
        TEST(sizes_beyond_the_caps_are_faults),
        TEST(reading_refuses_a_header_that_claims_too_much),
        TEST(reading_rejects_every_truncation),
        TEST(reading_survives_every_damaged_byte),
        TEST(reading_names_a_file_that_is_not_there),
        TEST(place_that_cannot_be_written_is_a_fault),
        TEST(pipes_and_devices_are_written_in_place),
        TEST(full_disk_is_a_fault),
        TEST(failed_write_leaves_the_good_file),
        TEST(link_to_a_picture_stays_a_link),
        TEST(video_of_ten_frames_has_ten),
        TEST(video_name_is_a_file_name_whatever_it_looks_like),
        TEST(video_of_odd_size_is_cropped_to_even),
        TEST(video_refuses_a_frame_of_another_size),
        TEST(video_without_frames_is_a_fault_and_no_file),
        TEST(absent_ffmpeg_names_its_package),
        TEST(closed_pipe_is_a_fault_and_no_signal),
        TEST(dying_ffmpeg_is_a_fault_with_its_last_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
