// Asks one of several servers: reads commands, a line each, and answers each by a line. `open ADDRESSES` connects; `query MAP`
// says at which revision which of two points are occupied; `insert MAP ID` adds a scan; `make MAP` makes a map.
#include <iostream>
#include <memory>
#include <mrol.hpp>
#include <sstream>

int main() {
    std::unique_ptr<mrol::client> client;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string command, name;
        words >> command >> name;
        try {
            if (command == "open") {
                client = std::make_unique<mrol::client>(name);
                std::cout << "ok";
            } else if (command == "query") {
                const std::vector<float> points = {0.05f, 0.05f, 0.05f, 5.0f, 5.0f, 5.0f};
                const mrol::answers answer = client->query(name, points);
                std::cout << answer.revision() << " " << answer[0] << answer[1];
            } else if (command == "insert") {
                unsigned long long id = 0;
                words >> id;
                const std::vector<float> points = {7.05f, 0.05f, 0.05f};
                const mrol::scan scan = mrol::scan("r", points).id(id, "run").at_guess().guess(mrol::pose());
                std::cout << client->insert(name, scan).revision();
            } else {
                client->create_map(name, 0.1, 4);
                std::cout << "ok";
            }
        } catch (const mrol::error &failed) {
            std::cout << mrol_code_name(failed.code()) << ": " << failed.what();
        }
        std::cout << std::endl;
    }
    return 0;
}
