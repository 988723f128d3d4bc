// Compare answers with test vectors: compare VECTORS.tsv ANSWERS.tsv
// Standard C++17, no library. Build: g++ -std=c++17 -O2 compare.cpp -o compare
// A line has six fields between tabs: sample, frame, reference, quantity, values, tolerances.
// A line of answers needs only the first five fields. The program counts the test vectors without an answer.
// Exit code 0: all numbers of all answers are within their tolerances; 1: a number is not within its tolerance;
// 2: a file cannot be read, or nothing was compared.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

struct Line {
    std::vector<double> values, tolerances;
};

std::vector<double> numbers(const std::string &text) {
    std::istringstream words(text);
    std::vector<double> found;
    for (std::string word; words >> word;) found.push_back(std::strtod(word.c_str(), nullptr));
    return found;
}

std::map<std::string, Line> read(const char *path) {  // keys: "sample, frame, reference, quantity"
    std::ifstream file(path);
    if (!file) { std::cerr << path << ": cannot be read\n"; std::exit(2); }
    std::map<std::string, Line> found;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line[0] == '#') continue;
        std::istringstream fields(line);
        std::string sample, frame, reference, quantity, values, tolerances;
        for (auto field : {&sample, &frame, &reference, &quantity, &values, &tolerances})
            std::getline(fields, *field, '\t');
        found[sample + ", " + frame + ", " + reference + ", " + quantity] = {numbers(values), numbers(tolerances)};
    }
    return found;
}

int main(int count, char **arguments) {
    if (count != 3) { std::cerr << "usage: compare VECTORS.tsv ANSWERS.tsv\n"; return 2; }
    auto answers = read(arguments[2]);
    int compared = 0, wrong = 0, missing = 0;
    for (const auto &[name, line] : read(arguments[1])) {
        if (line.tolerances.size() != line.values.size()) continue;  // a line with q, v or a
        if (!answers.count(name)) { ++missing; continue; }
        const auto &found = answers[name].values;
        if (found.size() != line.values.size()) {
            std::cout << name << ": " << found.size() << " numbers, expected " << line.values.size() << "\n";
            ++wrong;
            continue;
        }
        for (size_t i = 0; i < found.size(); ++i, ++compared)
            if (!(std::fabs(found[i] - line.values[i]) <= line.tolerances[i])) {
                std::cout.precision(17);
                std::cout << name << ", number " << i << ": " << found[i] << ", expected " << line.values[i]
                          << " within " << line.tolerances[i] << "\n";
                ++wrong;
            }
    }
    std::cout << compared << " numbers compared, " << wrong << " wrong, " << missing << " lines without an answer\n";
    return compared == 0 ? 2 : wrong != 0;
}
