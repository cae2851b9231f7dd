from tests.navigation.conftest import shared_data as shared_data
