// SPDX-License-Identifier: MIT
// Choosing devices by what a user types; pure text matching over a list, see device.h.
#include <algorithm>
#include <cctype>

#include "runtime/device.h"
#include "runtime/error.h"

namespace clume {

namespace {

std::string lower(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

std::vector<std::string> split_list(const std::vector<std::string>& selectors) {
    std::vector<std::string> words;
    for (const std::string& list : selectors) {
        for (std::size_t at = 0; at <= list.size();) {
            const std::size_t comma = std::min(list.find(',', at), list.size());
            std::string word = lower(list.substr(at, comma - at));
            word.erase(0, std::min(word.find_first_not_of(' '), word.size()));
            word.erase(word.find_last_not_of(' ') + 1);
            if (!word.empty()) words.push_back(std::move(word));
            at = comma + 1;
        }
    }
    return words;
}

/// "p0d1": then only the index may match, so that p0d1 doesn't mean p0d10.
bool is_index(const std::string& word) {
    const std::size_t d = word.find('d');
    const auto digits = [](std::string_view text) {
        return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
    };
    return word.size() >= 4 && word[0] == 'p' && d != std::string::npos && digits(std::string_view(word).substr(1, d - 1)) &&
           digits(std::string_view(word).substr(d + 1));
}

bool matches(const DeviceInfo& device, const std::string& word) {
    if (word == "all" || word == device.type) return true;
    if (word == "cpu" || word == "gpu" || word == "accelerator") return false;
    if (is_index(word)) return device.id.substr(0, device.id.find('-')) == word;
    return lower(device.name).find(word) != std::string::npos || lower(device.platform).find(word) != std::string::npos ||
           device.id.find(word) != std::string::npos;
}

std::string listing(const std::vector<DeviceInfo>& devices) {
    std::string text = "; devices here:";
    for (const DeviceInfo& device : devices) {
        text += "\n  " + device.id + "  (" + device.type + ", " + device.platform + ")";
        if (!device.available) text += " unavailable";
    }
    return text;
}

int rank(const DeviceInfo& device) {
    return device.type == "gpu" ? 2 : device.type == "cpu" ? 1 : 0;
}

DeviceInfo best(const std::vector<DeviceInfo>& devices) {
    const DeviceInfo* chosen = nullptr;
    for (const DeviceInfo& device : devices) {
        if (!device.available) continue;
        if (!chosen || rank(device) > rank(*chosen) ||
            (rank(device) == rank(*chosen) && device.compute_units > chosen->compute_units))
            chosen = &device;
    }
    if (!chosen) throw DeviceError("no OpenCL device is available" + listing(devices));
    return *chosen;
}

}  // namespace

std::vector<DeviceInfo> select_from(const std::vector<DeviceInfo>& devices, const std::vector<std::string>& selectors) {
    if (devices.empty())
        throw DeviceError("no OpenCL device found; install one, on Debian or Ubuntu: apt install pocl-opencl-icd");
    const std::vector<std::string> words = split_list(selectors);
    if (words.empty()) return {best(devices)};
    std::vector<DeviceInfo> chosen;
    for (const std::string& word : words) {
        bool known = false, usable = false;
        for (const DeviceInfo& device : devices) {
            if (!matches(device, word)) continue;
            known = true;
            if (!device.available) continue;
            usable = true;
            const bool twice =
                std::any_of(chosen.begin(), chosen.end(), [&](const DeviceInfo& other) { return other.id == device.id; });
            if (!twice) chosen.push_back(device);
        }
        if (!known) throw DeviceError("no device matches '" + word + "'" + listing(devices));
        if (!usable) throw DeviceError("the device '" + word + "' is not available" + listing(devices));
    }
    return chosen;
}

}  // namespace clume
